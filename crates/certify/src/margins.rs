//! How far a bound of the family may be moved, and how far it must be: bisection of an exact check.

use certune_verify::{Document, LoopBox, Number, Quantity, Variation, family_box};

/// Bounds are looked for up to this factor away from where the family puts them.
const FARTHEST: f64 = 1e3;
/// Bisections: a share of 2^-12 of the first bracket, about as fine as four digits.
const BISECTIONS: u32 = 12;

/// Whether every linearised loop of a box is stable, exactly.
pub(crate) type Stable<'a> = &'a dyn Fn(&LoopBox) -> bool;

/// Four significant digits: what is tried is what is written.
fn short(x: f64) -> Option<Number> {
    let x: f64 = format!("{x:.3e}").parse().ok()?;
    Number::decimal(x)
}

/// The value nearest to `refused` that passes, between `passing` (not tried again) and `refused`; `None` when only `passing` does.
fn boundary(mut passing: f64, mut refused: f64, passes: &dyn Fn(&Number) -> bool) -> Option<Number> {
    let mut best = None;
    for _ in 0..BISECTIONS {
        let geometric = passing > 0.0 && refused > 0.0;
        let middle = if geometric { (passing * refused).sqrt() } else { 0.5 * (passing + refused) };
        let number = short(middle)?;
        if passes(&number) {
            passing = middle;
            best = Some(number);
        } else {
            refused = middle;
        }
    }
    best
}

/// From `from`, by doubling, the first value that passes (or, with `wanted` false, fails), at most [`FARTHEST`] times as large.
fn doubled(from: f64, wanted: bool, passes: &dyn Fn(&Number) -> bool) -> Option<f64> {
    std::iter::successors(Some(from), |x| Some(2.0 * x))
        .take_while(|x| *x <= from * FARTHEST)
        .find(|&x| short(x).is_some_and(|number| passes(&number) == wanted))
}

fn variation(of: Quantity, value: Number) -> Variation {
    Variation { of, value }
}

struct Family<'a> {
    document: &'a Document,
    friction: f64,
    rotor: f64,
    inertia: [f64; 2],
    stiffness: f64,
}

impl<'a> Family<'a> {
    fn of(document: &'a Document) -> Self {
        let range = family_box(document);
        Self {
            document,
            friction: range.friction[0].to_f64(),
            rotor: document.family.arms.rotor_inertia_kg_m2[0].to_f64(),
            inertia: [range.inertia[0].to_f64(), range.inertia[1].to_f64()],
            stiffness: range.stiffness[1].to_f64(),
        }
    }

    fn passes<'b>(&'b self, of: Quantity, stable: Stable<'b>) -> impl Fn(&Number) -> bool + 'b {
        move |value| stable(&variation(of, value.clone()).applied(self.document))
    }
}

/// The margins of a family whose loops are stable: least friction and rotor inertia (unless 0 already), largest inertia, and largest gravity
/// stiffness unless `gravity_free`.
pub(crate) fn margins(document: &Document, gravity_free: bool, stable: Stable<'_>) -> Vec<Variation> {
    let family = Family::of(document);
    let mut found = Vec::new();
    for (of, least) in [(Quantity::LeastFriction, family.friction), (Quantity::LeastRotorInertia, family.rotor)] {
        let passes = family.passes(of, stable);
        if least <= 0.0 {
            continue;
        }
        let value = if passes(&Number::zero()) { Some(Number::zero()) } else { boundary(least, 0.0, &passes) };
        found.extend(value.map(|value| variation(of, value)));
    }
    let stiffness = (!gravity_free).then_some((Quantity::LargestStiffness, family.stiffness));
    for (of, largest) in std::iter::once((Quantity::LargestInertia, family.inertia[1])).chain(stiffness) {
        let passes = family.passes(of, stable);
        // A family without gravity stiffness: look from 1 N m/rad up, and below it.
        let from = if largest > 0.0 { largest } else { 1.0 };
        let value = match doubled(from, false, &passes) {
            Some(refused) => boundary(largest.max(0.0), refused, &passes),
            None => short(from * 0.5 * FARTHEST).filter(|value| passes(value)),
        };
        found.extend(value.map(|value| variation(of, value)));
    }
    found
}

/// What would make the loops of a family stable, one bound at a time.
pub(crate) fn remedies(document: &Document, gravity_free: bool, stable: Stable<'_>) -> Vec<Variation> {
    let family = Family::of(document);
    let mut found = Vec::new();
    for (of, least, start) in
        [(Quantity::LeastFriction, family.friction, 0.01), (Quantity::LeastRotorInertia, family.rotor, 0.001)]
    {
        let passes = family.passes(of, stable);
        if let Some(enough) = doubled(least.max(start), true, &passes) {
            found.extend(boundary(enough, least, &passes).or_else(|| short(enough)).map(|value| variation(of, value)));
        }
    }
    let inertia = (Quantity::LargestInertia, family.inertia[1], family.inertia[0]);
    let stiffness =
        (!gravity_free && family.stiffness > 0.0).then_some((Quantity::LargestStiffness, family.stiffness, 0.0));
    for (of, largest, least) in std::iter::once(inertia).chain(stiffness) {
        let passes = family.passes(of, stable);
        // A hair above the least inertia: four digits must not fall below it.
        let Some(enough) = short(least * 1.001).filter(|value| passes(value)) else { continue };
        let value = boundary(enough.to_f64(), largest, &passes).unwrap_or(enough);
        found.push(variation(of, value));
    }
    found
}
