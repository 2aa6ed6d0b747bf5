// Pinocchio's side of the yardstick: one algorithm or the closed loop, on the thread's own CPU time.
//
//   pinocchio MODEL.txt WORK     prints "WORK NS_PER_ITEM"
//
// MODEL.txt holds the number of joints, then for each R (row by row), p, mass, centre of mass, inertia about it (xx yy zz xy xz yz), lower and upper
// position, speed and torque limits. Pinocchio is used from its headers alone, so that -march=native does not meet the alignment of a built library.
#include <pinocchio/multibody.hpp>

#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <cstdio>
#include <ctime>
#include <fstream>
#include <random>
#include <string>
#include <vector>

namespace pin = pinocchio;
using Vector = Eigen::VectorXd;
constexpr int N = 7;
constexpr int STATES = 512;
using Array = Eigen::Array<double, N, 1>;

static double cpu_s() {
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static volatile double sink;

// Nanoseconds per call over about 0.3 s.
template <class F> static double time_ns(F work) {
    long count = 256;
    for (;;) {
        double start = cpu_s(), sum = 0;
        for (long k = 0; k < count; ++k) sum += work(k % STATES);
        sink = sum;
        double spent = cpu_s() - start;
        if (spent > 0.3) return spent / count * 1e9;
        count = spent > 0.01 ? long(count * 0.4 / spent) + 1 : 4 * count;
    }
}

struct Aic {
    double kappa_mu = 11.67, kappa_a = 700, q = 1, dq = 1, prior_mu = 1.0 / 5, prior_dmu = 1.0 / 10, h = 1e-3;
    Array mu, dmu = Array::Zero(), ddmu = Array::Zero(), u = Array::Zero();
    explicit Aic(const Array &at) : mu(at) {}
    void step(const Array &y, const Array &dy, const Array &goal) {
        const Array e0 = (y - mu) * q, e1 = (dy - dmu) * dq;
        const Array em = (dmu + mu - goal) * prior_mu, ed = (ddmu + dmu) * prior_dmu;
        const Array by_mu = dmu - kappa_mu * (em - e0), by_dmu = ddmu - kappa_mu * (em - e1 + ed);
        mu += h * by_mu;
        dmu += h * by_dmu;
        ddmu -= h * kappa_mu * ed;
        u -= h * kappa_a * ((dy - dmu) * dq + (y - mu) * q);
    }
};

int main(int argc, char **argv) {
    if (argc != 3) {
        std::fprintf(stderr, "usage: %s MODEL.txt WORK\n", argv[0]);
        return 2;
    }
    std::ifstream in(argv[1]);
    const std::string work = argv[2];
    int joints = 0;
    if (!(in >> joints) || joints != N) {
        std::fprintf(stderr, "%s: no model of %d joints\n", argv[1], N);
        return 2;
    }
    pin::Model model;
    Array lower, upper, speed, torque;
    pin::JointIndex parent = 0;
    for (int i = 0; i < N; ++i) {
        Eigen::Matrix3d R, I;
        Eigen::Vector3d p, c;
        double mass, x[6];
        for (int k = 0; k < 9; ++k) in >> R(k / 3, k % 3);
        for (int k = 0; k < 3; ++k) in >> p[k];
        in >> mass;
        for (int k = 0; k < 3; ++k) in >> c[k];
        for (double &value : x) in >> value;
        I << x[0], x[3], x[4], x[3], x[1], x[5], x[4], x[5], x[2];
        in >> lower[i] >> upper[i] >> speed[i] >> torque[i];
        parent = model.addJoint(parent, pin::JointModelRZ(), pin::SE3(R, p), "j" + std::to_string(i + 1));
        model.appendBodyToJoint(parent, pin::Inertia(mass, c, I), pin::SE3::Identity());
    }
    if (!in) {
        std::fprintf(stderr, "%s: ends early\n", argv[1]);
        return 2;
    }
    pin::Data data(model);
    std::mt19937_64 bits(7);
    auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(bits); };
    std::vector<Vector> q(STATES, Vector(N)), v(STATES, Vector(N)), a(STATES, Vector(N)), t(STATES, Vector(N));
    for (int k = 0; k < STATES; ++k)
        for (int i = 0; i < N; ++i) {
            q[k][i] = between(lower[i], upper[i]);
            v[k][i] = between(-speed[i], speed[i]);
            a[k][i] = between(-5, 5);
            t[k][i] = between(-torque[i], torque[i]);
        }
    const auto local = pin::Convention::LOCAL, world = pin::Convention::WORLD;
    double ns = 0;
    if (work == "check") {
        // The accelerations of the first state, for the other side to compare: nothing to time.
        const Vector at = Vector::LinSpaced(N, 0.1, 0.7), rate = Vector::LinSpaced(N, 0.3, -0.3), tau = Vector::LinSpaced(N, 2, -1);
        const Vector ddq = pin::aba(model, data, at, rate, tau);
        std::printf("check");
        for (int i = 0; i < N; ++i) std::printf(" %.17g", ddq[i]);
        std::printf("\n");
        return 0;
    } else if (work == "rnea") {
        ns = time_ns([&](int k) { return pin::rnea(model, data, q[k], v[k], a[k])[0]; });
    } else if (work == "gravity") {
        ns = time_ns([&](int k) { return pin::computeGeneralizedGravity(model, data, q[k])[0]; });
    } else if (work == "aba") {
        ns = std::min(time_ns([&](int k) { return pin::aba(model, data, q[k], v[k], t[k], local)[0]; }),
                      time_ns([&](int k) { return pin::aba(model, data, q[k], v[k], t[k], world)[0]; }));
    } else if (work == "crba") {
        ns = std::min(time_ns([&](int k) { return pin::crba(model, data, q[k], local)(0, 0); }),
                      time_ns([&](int k) { return pin::crba(model, data, q[k], world)(0, 0); }));
    } else if (work == "linearise") {
        ns = time_ns([&](int k) {
            pin::computeABADerivatives(model, data, q[k], v[k], t[k]);
            return data.ddq_dq(0, 0);
        });
    } else if (work == "aic") {
        Array y = Array::Zero(), dy = Array::Zero(), goal = Array::Constant(0.3);
        Aic c(y);
        ns = time_ns([&](int) {
            c.step(y, dy, goal);
            y[0] = c.u[0] * 1e-9;
            return c.u[0];
        });
    } else if (work == "closed-loop") {
        const Array A{{1, .5, 0, -2, 0, 2.5, 0}}, B{{0, .2, 0, -1, 0, 1.2, 0}}, C{{-1, .5, 0, -1.2, 0, 1.6, 0}};
        const Array *goals[4] = {&A, &B, &C, &B};
        const int steps = 24000;
        double best = 1e300;
        for (auto convention : {local, world, local, world}) {
            Vector at = B.matrix(), rate = Vector::Zero(N), tau(N);
            Aic c(B);
            const double start = cpu_s();
            for (int s = 0; s < steps; ++s) {
                c.step(at.array(), rate.array(), *goals[s / 6000]);
                tau = c.u.max(-torque).min(torque).matrix();
                rate += c.h * pin::aba(model, data, at, rate, tau, convention);
                at += c.h * rate;
            }
            best = std::min(best, cpu_s() - start);
            sink = at[1];
        }
        ns = best / steps * 1e9;
    } else {
        std::fprintf(stderr, "no such work: %s\n", work.c_str());
        return 2;
    }
    std::printf("%s %.2f\n", work.c_str(), ns);
    return 0;
}
