//! Branch and bound: a box of angles is cut until a form is positive on every piece.
//!
//! A box is one part of `2^depth` equal parts of each joint's interval. A box that is not settled is cut in two across the angle whose
//! width cost most. The tree of cuts depends on nothing but the arm, the set and the form, so the count of boxes is the
//! same for any number of threads; a budget on it decides in the same way.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::angle::Arc;
use super::chain::Chain;
use super::forms::{Form, Verdict, test};

/// The size of a finished cover.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    /// Boxes tested.
    pub boxes: u64,
    /// Most cuts of one angle.
    pub depth: u32,
}

/// A box: for each joint which part of how many.
#[derive(Clone, Copy)]
struct Cell<const N: usize> {
    depth: [u32; N],
    index: [u64; N],
}

/// A cover in progress.
struct Cover<'a, const N: usize> {
    chain: &'a Chain<N>,
    forms: &'a [Form<N>],
    set: &'a [[f64; 2]; N],
    budget: u64,
    boxes: AtomicU64,
    stopped: AtomicBool,
    done: AtomicU64,
    progress: &'a (dyn Fn(f64) + Sync),
}

/// Cuts of one angle at most: parts of a full turn finer than 1e-6 rad.
const DEEPEST: u32 = 22;
/// Cuts handed to other threads.
const SHARED_CUTS: u32 = 16;
/// Progress is counted in these parts of the whole.
const GRAIN: f64 = 1e12;

/// True if every form is positive definite over the whole set, shown with at most `budget` boxes.
pub(crate) fn cover<const N: usize>(
    chain: &Chain<N>,
    forms: &[Form<N>],
    set: &[[f64; 2]; N],
    budget: u64,
    progress: &(dyn Fn(f64) + Sync),
) -> Option<Tally> {
    let work = Cover {
        chain,
        forms,
        set,
        budget,
        boxes: AtomicU64::new(0),
        stopped: AtomicBool::new(false),
        done: AtomicU64::new(0),
        progress,
    };
    let depth = work.settle(&Cell { depth: [0; N], index: [0; N] }, 0, 1.0)?;
    Some(Tally { boxes: work.boxes.load(Ordering::Relaxed), depth })
}

impl<const N: usize> Cover<'_, N> {
    /// The most cuts of one angle below this cell, or nothing.
    fn settle(&self, cell: &Cell<N>, cuts: u32, share: f64) -> Option<u32> {
        if self.stopped.load(Ordering::Relaxed) {
            return None;
        }
        if self.boxes.fetch_add(1, Ordering::Relaxed) >= self.budget {
            self.stopped.store(true, Ordering::Relaxed);
            return None;
        }
        let across = match self.test(cell) {
            Ok(()) => {
                self.report(share);
                return cell.depth.iter().copied().max();
            }
            Err(Some(across)) if cell.depth[across] < DEEPEST => across,
            Err(_) => {
                self.stopped.store(true, Ordering::Relaxed);
                return None;
            }
        };
        let child = |half: u64| {
            let mut child = *cell;
            child.depth[across] += 1;
            child.index[across] = 2 * cell.index[across] + half;
            child
        };
        let run = |half: u64| self.settle(&child(half), cuts + 1, 0.5 * share);
        let (left, right) = if cuts < SHARED_CUTS { rayon::join(|| run(0), || run(1)) } else { (run(0), run(1)) };
        Some(left?.max(right?))
    }

    /// Settled, or the angle to cut; no angle if the form is violated.
    fn test(&self, cell: &Cell<N>) -> Result<(), Option<usize>> {
        let mut arcs = [Arc { cosine: 1.0, sine: 0.0, tau: 0.0, half_width: 0.0 }; N];
        for joint in 1..N {
            let [lower, upper] = self.set[joint];
            match Arc::part(lower, upper, cell.depth[joint], cell.index[joint]) {
                Some(arc) => arcs[joint] = arc,
                None => return Err(Some(joint)),
            }
        }
        for form in self.forms {
            match test(self.chain, form, &arcs) {
                Verdict::Positive => {}
                Verdict::Violated => return Err(None),
                Verdict::Open(costs) => {
                    let mut across = None;
                    let mut most = 0.0;
                    for joint in 1..N {
                        if costs[joint] > most && cell.depth[joint] < DEEPEST {
                            most = costs[joint];
                            across = Some(joint);
                        }
                    }
                    return Err(across);
                }
            }
        }
        Ok(())
    }

    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of 1e12"
    )]
    fn report(&self, share: f64) {
        let part = (share * GRAIN) as u64;
        let before = self.done.fetch_add(part, Ordering::Relaxed);
        // A thousand reports in all are plenty.
        if (before + part) / 1_000_000_000 != before / 1_000_000_000 {
            (self.progress)((before + part) as f64 / GRAIN);
        }
    }
}
