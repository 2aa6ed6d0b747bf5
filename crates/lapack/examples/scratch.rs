//! scratch
#![allow(warnings, clippy::all)]
#[path = "../tests/common/mod.rs"]
mod common;
use common::*;
use std::time::Instant;
fn main() {
    let mut seed = 1u64;
    let mut rnd = move || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((seed >> 11) as f64 / (1u64 << 53) as f64) * 2.0 - 1.0
    };
    let n = 42;
    let e: Vec<f64> = (0..n * n).map(|_| rnd()).collect();
    let a = Matrix::<f64>::from_fn(n, n, 0, |i, j| e[i.min(j) + i.max(j) * n]);
    let g = Matrix::<f64>::from_fn(n, n, 0, |i, j| e[i + j * n]);
    let time = |name: &str, f: &mut dyn FnMut()| {
        for _ in 0..20 {
            f();
        }
        let t = Instant::now();
        for _ in 0..300 {
            f();
        }
        println!("{name}: {:.1} us", t.elapsed().as_secs_f64() / 300.0 * 1e6);
    };
    time("syevr N", &mut || {
        eigen(&a, b'N', b'U', Wanted::All, 0);
    });
    time("syevr V", &mut || {
        eigen(&a, b'V', b'U', Wanted::All, 0);
    });
    time("gesdd S", &mut || {
        svd(&g, (b'S', b'S'), false, 0);
    });
    let mut c = vec![0.0; n * n];
    time("gemm", &mut || {
        f64::gemm(b'N', b'T', 42, 42, 42, 1.0, &g.data, 42, &a.data, 42, 0.0, &mut c, 42);
    });
    time("syrk", &mut || {
        f64::syrk(b'U', b'N', 42, 42, 1.0, &g.data, 42, 0.0, &mut c, 42);
    });
    f64::gemm(b'N', b'T', 42, 42, 42, 1.0, &g.data, 42, &g.data, 42, 0.0, &mut c, 42);
    for i in 0..n {
        c[i * n + i] += 1.0;
    }
    time("potrf", &mut || {
        let mut l = c.clone();
        let mut info = 0;
        f64::potrf(b'L', 42, &mut l, 42, &mut info);
        assert_eq!(info, 0);
    });
    // stress
    let mut fails = 0;
    let mut total = 0;
    let mut slow = 0.0f64;
    let mut worst = 0.0f64;
    let t0 = Instant::now();
    while t0.elapsed().as_secs_f64() < 40.0 {
        let n = 2 + (total % 60);
        let kind = (total / 60) % 8;
        let dec = [0.0, 4.0, 8.0, 16.0, 30.0, 100.0, 1.0, 0.0][kind];
        let m = Matrix::<f64>::from_fn(n, n, 0, |_, _| 0.0);
        let mut m = m;
        for j in 0..n {
            for i in 0..n {
                let s = 10f64.powf(-dec * (j as f64 / n as f64))
                    * if kind == 6 { 10f64.powf(-8.0 * i as f64 / n as f64) } else { 1.0 };
                let v = if kind == 3 && i > j {
                    0.0
                } else if kind == 7 {
                    (rnd() * 2.0).round()
                } else {
                    rnd()
                };
                m.set(i, j, v * s);
            }
        }
        let t = Instant::now();
        let r = svd(&m, (b'S', b'S'), false, 0);
        slow = slow.max(t.elapsed().as_secs_f64());
        if r.info != 0 {
            fails += 1;
            println!("svd fail n {n} kind {kind}");
        } else {
            let og = orthogonality_gap(&r.u).max(orthogonality_gap(&r.vt));
            let s: Vec<f64> = r.values.clone();
            let gap = product_gap((n, n, n), |i, k| r.u.at(i, k) * s[k], |k, j| r.vt.at(k, j), |i, j| m.at(i, j));
            worst = worst.max((gap / s[0].max(1e-300)).max(og) / (n as f64 * f64::EPSILON));
        }
        let sm = Matrix::<f64>::from_fn(n, n, 0, |i, j| m.at(i.min(j), i.max(j)));
        let t = Instant::now();
        let r = eigen(&sm, b'V', b'U', Wanted::All, 0);
        slow = slow.max(t.elapsed().as_secs_f64());
        if r.info != 0 {
            fails += 1;
            println!("eig fail n {n} kind {kind}");
        } else {
            let gap = product_gap(
                (n, n, n),
                |i, k| sm.at(i, k),
                |k, j| r.vectors.at(k, j),
                |i, j| r.vectors.at(i, j) * r.values[j],
            );
            worst = worst
                .max((gap / sm.max_abs().max(1e-300)).max(orthogonality_gap(&r.vectors)) / (n as f64 * f64::EPSILON));
        }
        total += 1;
    }
    println!("{total} matrices, {fails} failures, slowest {slow} s, worst {worst} n eps");
}
