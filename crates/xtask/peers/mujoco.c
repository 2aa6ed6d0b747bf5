/* MuJoCo's side of the yardstick: the AIC on the arm, 24 s of pick and place at 1 ms, on the thread's own CPU time.
 *
 *   mujoco MODEL.xml closed-loop     prints "closed-loop NS_PER_STEP" of the fastest of its configurations
 *
 * Build: cc -O3 -march=native -I$MUJOCO/include mujoco.c $MUJOCO/libmujoco.so.* -Wl,-rpath,$MUJOCO -lm */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { N = 7, STEPS = 24000 };

static const double A[N] = {1, .5, 0, -2, 0, 2.5, 0}, B[N] = {0, .2, 0, -1, 0, 1.2, 0}, C[N] = {-1, .5, 0, -1.2, 0, 1.6, 0};
static const double LIMIT[N] = {87, 87, 87, 87, 12, 12, 12};

static double cpu_s(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

struct beliefs { double mu[N], dmu[N], ddmu[N], u[N]; };

/* The published gains of the simulation: kappa_mu 11.67, kappa_a 700, variances 1, 1, 5, 10. */
static void aic(struct beliefs *c, const double *q, const double *dq, const double *goal) {
    const double kappa_mu = 11.67, kappa_a = 700, mu = 1.0 / 5, dmu = 1.0 / 10, h = 1e-3;
    for (int i = 0; i < N; i++) {
        double e0 = q[i] - c->mu[i], e1 = dq[i] - c->dmu[i];
        double em = (c->dmu[i] + c->mu[i] - goal[i]) * mu, ed = (c->ddmu[i] + c->dmu[i]) * dmu;
        double by_mu = c->dmu[i] - kappa_mu * (em - e0), by_dmu = c->ddmu[i] - kappa_mu * (em - e1 + ed);
        c->mu[i] += h * by_mu;
        c->dmu[i] += h * by_dmu;
        c->ddmu[i] -= h * kappa_mu * ed;
        c->u[i] -= h * kappa_a * (dq[i] - c->dmu[i] + q[i] - c->mu[i]);
    }
}

static double closed_loop_s(const mjModel *m, mjData *d) {
    const double *goals[4] = {A, B, C, B};
    struct beliefs c;
    memset(&c, 0, sizeof c);
    mj_resetData(m, d);
    memcpy(d->qpos, B, sizeof B);
    memcpy(c.mu, B, sizeof B);
    double start = cpu_s();
    for (int s = 0; s < STEPS; s++) {
        aic(&c, d->qpos, d->qvel, goals[s / 6000]);
        for (int i = 0; i < N; i++) d->qfrc_applied[i] = fmax(-LIMIT[i], fmin(LIMIT[i], c.u[i]));
        mj_step(m, d);
    }
    double spent = cpu_s() - start;
    /* A run that did not arrive would be no run. */
    return fabs(d->qpos[0] - B[0]) < 0.05 ? spent : NAN;
}

int main(int argc, char **argv) {
    if (argc != 3 || strcmp(argv[2], "closed-loop") != 0) {
        fprintf(stderr, "usage: %s MODEL.xml closed-loop\n", argv[0]);
        return 2;
    }
    char error[500];
    mjModel *m = mj_loadXML(argv[1], NULL, error, sizeof error);
    if (!m || m->nv != N) {
        fprintf(stderr, "%s\n", m ? "the model has not 7 joints" : error);
        return 2;
    }
    mjData *d = mj_makeData(m);
    m->opt.timestep = 1e-3;
    const int own = m->opt.disableflags, bare = mjDSBL_CONSTRAINT | mjDSBL_SENSOR | mjDSBL_ACTUATION | mjDSBL_EULERDAMP;
    const struct { int integrator, flags; } configurations[] = {
        {mjINT_EULER, 0}, {mjINT_EULER, mjDSBL_EULERDAMP}, {mjINT_EULER, bare}, {mjINT_IMPLICITFAST, 0}, {mjINT_IMPLICITFAST, bare}};
    double best = INFINITY;
    for (size_t k = 0; k < sizeof configurations / sizeof *configurations; k++) {
        m->opt.integrator = configurations[k].integrator;
        m->opt.disableflags = own | configurations[k].flags;
        for (int repeat = 0; repeat < 2; repeat++) best = fmin(best, closed_loop_s(m, d));
    }
    printf("closed-loop %.2f\n", best / STEPS * 1e9);
    mj_deleteData(d);
    mj_deleteModel(m);
    return 0;
}
