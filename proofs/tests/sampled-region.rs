//! `claims/sampled-region.md` on the Panda with rotor inertia 0.1 kg m^2: the published simulation gains at 1 kHz with one sample of delay, gravity
//! compensated at every sample, friction 1 N m s/rad.
#![expect(clippy::panic, clippy::unwrap_used, reason = "test helpers")]

use certune::Request;
use certune::certify::FamilyValues;
use certune::dynamics::{Model, Robot, mass_matrix, mass_matrix_derivatives};
use certune::linsys::{JointMatrix, Joints};
use certune::verify::{Certificate, Claim, ClaimKind, Grade};
use proofs::{nominal_family, panda, published_aic, stored};

const ROTOR_KG_M2: f64 = 0.1;
/// Random configurations that the constants are tried on, each with one local maximisation.
const SAMPLES: usize = 2_000;

fn family() -> FamilyValues {
    FamilyValues { rotor_inertia_kg_m2: [ROTOR_KG_M2; 2], ..nominal_family(true, [1.0, 1.0]) }
}

fn derived() -> Certificate {
    let request = Request { claims: vec![ClaimKind::SampledRegion], delay_samples: Some(1), ..Request::default() };
    let gains = published_aic("simulation").unwrap();
    panda(&family()).unwrap().answer(&gains.into(), &request).unwrap().certificate
}

fn radius(certificate: &Certificate) -> f64 {
    match &certificate.document().claims[0].claim {
        Claim::SampledRegion(claim) => {
            assert_eq!(claim.sampling.delay_samples, 1);
            claim.radius_rad.to_f64()
        }
        other => panic!("{other:?}"),
    }
}

/// Two derivations may differ by where an interior-point iteration stops.
const RADIUS_SPREAD_RAD: f64 = 0.02;

#[test]
fn the_published_gains_have_a_region_when_sampled_and_delayed() {
    let derived = derived();
    let stored = stored("sampled-region", &derived).unwrap();
    for certificate in [&derived, &stored] {
        assert!(certificate.all_hold());
        assert_eq!(certificate.checked()[0].grade, Some(Grade::Proved));
        assert!(radius(certificate) >= 0.5, "{}", radius(certificate));
    }
    println!("radius {} rad", radius(&derived));
    assert!((radius(&derived) - radius(&stored)).abs() <= RADIUS_SPREAD_RAD);
    assert_eq!(derived.document().arm, stored.document().arm, "the stored certificate is about another arm");
}

/// Halton's sequence: the same configurations everywhere, no two alike.
fn halton(mut index: usize, base: usize) -> f64 {
    let (mut x, mut place) = (0.0, 1.0);
    while index > 0 {
        place /= base as f64;
        x += place * (index % base) as f64;
        index /= base;
    }
    x
}

#[test]
fn random_configurations_respect_the_constants() {
    let model = Model::<7>::new(&Robot::panda()).unwrap().with_rotor_inertia(&Joints::repeat(ROTOR_KG_M2));
    let bases = [2, 3, 5, 7, 11, 13, 17];
    let (mut least, mut largest, mut k_m, mut k_c, mut k_r) = (f64::INFINITY, 0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    for sample in 1..=SAMPLES {
        let q = Joints::<7>::from_fn(|j, _| (2.0 * halton(sample, bases[j]) - 1.0) * std::f64::consts::PI);
        let mass = mass_matrix(&model, &q);
        let slopes = mass_matrix_derivatives(&model, &q);
        let values = mass.symmetric_eigenvalues();
        least = least.min(values.min());
        largest = largest.max(values.max());
        // c(y, v) = v'(sum_j y_j dM/dq_j) v / 2 in the metrics of y and v: alternately the best y and the best v.
        let factor = mass.cholesky().unwrap().l();
        let plain = JointMatrix::<7>::identity();
        for (y_factor, v_factor, most) in
            [(&factor, &factor, &mut k_m), (&plain, &plain, &mut k_c), (&plain, &factor, &mut k_r)]
        {
            let y_inverse = y_factor.try_inverse().unwrap();
            let inverse = v_factor.try_inverse().unwrap();
            let mut v =
                inverse.transpose() * Joints::<7>::from_fn(|j, _| halton(sample, bases[6 - j]) - 0.5).normalize();
            for _ in 0..12 {
                let gradient = Joints::<7>::from_fn(|j, _| 0.5 * v.dot(&(slopes[j] * v)));
                let y = y_inverse.transpose() * (y_inverse * gradient).normalize();
                let slope = (0..7).fold(JointMatrix::<7>::zeros(), |sum, j| sum + slopes[j] * (0.5 * y[j]));
                let form = inverse * slope * inverse.transpose();
                let eigen = ((form + form.transpose()) * 0.5).symmetric_eigen();
                let index = eigen.eigenvalues.iamax();
                *most = most.max(eigen.eigenvalues[index].abs());
                v = inverse.transpose() * eigen.eigenvectors.column(index);
            }
        }
    }
    println!("m {least} to {largest}, k_m {k_m}, k_c {k_c}, k_r {k_r}");
    let arm = panda(&family()).unwrap();
    let proved = &arm.record().unwrap().bounds;
    let most = |number: &Option<certune::verify::Number>| number.as_ref().unwrap().to_f64();
    assert!(proved.m_lo_kg_m2.to_f64() <= least && largest <= proved.m_hi_kg_m2.to_f64());
    assert!(k_m <= most(&proved.k_m) && k_c <= proved.k_c_kg_m2.to_f64() && k_r <= most(&proved.k_r));
}
