//! Visiting every corner of a product of polygons, tip first, in chunks that may run on several threads.
//!
//! The joint nearest the tip changes slowest, so what depends on the tip alone is computed once for all that follows. Chunks are
//! formed from the corners alone and each starts from the same values; results are combined in order: the outcome is the same to
//! the bit for any number of threads.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::rigorous::scalar::larger;

/// Chunks per sweep, at least, where the product is large enough.
const CHUNKS: usize = 256;
/// Corners that the first, thinned sweep visits, about.
const THINNED: f64 = 4096.0;

/// A quantity to be maximised over a product of corners.
pub(crate) trait Sweep: Sync {
    /// What is kept along the way, results included.
    type State;
    /// The state before the first joint, with these maxima to start from; an empty list stands for nothing known.
    fn begin(&self, maxima: &[f64]) -> Self::State;
    /// Sets joint `joint` to a corner; the joints beyond it are set, those before it are not.
    fn descend(&self, state: &mut Self::State, joint: usize, corner: [f64; 2]);
    /// Takes the maximum with all joints set.
    fn visit(&self, state: &mut Self::State);
    /// The maxima so far.
    fn maxima(&self, state: &Self::State) -> Vec<f64>;
}

/// Reports how much of a long computation is done: a share in `[0, 1]`.
#[derive(Clone, Copy)]
pub(crate) struct Progress<'a> {
    pub report: &'a (dyn Fn(f64) + Sync),
    pub from: f64,
    pub to: f64,
}

impl Progress<'_> {
    fn at(&self, share: f64) {
        (self.report)(self.from + share * (self.to - self.from));
    }

    /// The part between two shares of this one.
    pub(crate) fn part(&self, from: f64, to: f64) -> Self {
        let width = self.to - self.from;
        Self { report: self.report, from: self.from + from * width, to: self.from + to * width }
    }
}

/// Maxima over all corners: `corners[j]` for joint `first + j`, up to the tip.
pub(crate) fn maxima<S: Sweep>(sweep: &S, first: usize, corners: &[Vec<[f64; 2]>], progress: Progress) -> Vec<f64> {
    let total: f64 = corners.iter().map(|list| list.len() as f64).product();
    // A thinned sweep first, so that every chunk starts near the maximum. Its corners are among the others.
    let mut stride = 1.0_f64;
    while total / stride.powi(corners.len() as i32) > THINNED && stride < 64.0 {
        stride *= 1.25;
    }
    let thinned: Vec<Vec<[f64; 2]>> = corners
        .iter()
        .map(|list| {
            let kept = (list.len() as f64 / stride).ceil().max(1.0) as usize;
            (0..kept).map(|k| list[k * list.len() / kept]).collect()
        })
        .collect();
    let silent = Progress { report: &|_| {}, from: 0.0, to: 0.0 };
    let start = if stride > 1.0 { all(sweep, first, &thinned, &[], silent) } else { Vec::new() };
    all(sweep, first, corners, &start, progress)
}

fn all<S: Sweep>(sweep: &S, first: usize, corners: &[Vec<[f64; 2]>], start: &[f64], progress: Progress) -> Vec<f64> {
    let mut fixed = 0;
    let mut chunks = 1;
    while fixed < corners.len() && chunks < CHUNKS {
        fixed += 1;
        chunks *= corners[corners.len() - fixed].len();
    }
    let free = &corners[..corners.len() - fixed];
    let done = AtomicUsize::new(0);
    let results: Vec<Vec<f64>> = (0..chunks)
        .into_par_iter()
        .map(|chunk| {
            let mut state = sweep.begin(start);
            let mut rest = chunk;
            for place in (free.len()..corners.len()).rev() {
                let list = &corners[place];
                sweep.descend(&mut state, first + place, list[rest % list.len()]);
                rest /= list.len();
            }
            descend_all(sweep, &mut state, first, free);
            let count = 1 + done.fetch_add(1, Ordering::Relaxed);
            progress.at(count as f64 / chunks as f64);
            sweep.maxima(&state)
        })
        .collect();
    let mut maxima = start.to_vec();
    for result in results {
        if maxima.is_empty() {
            maxima = result;
        } else {
            for (maximum, value) in maxima.iter_mut().zip(result) {
                *maximum = larger(*maximum, value);
            }
        }
    }
    maxima
}

fn descend_all<S: Sweep>(sweep: &S, state: &mut S::State, first: usize, free: &[Vec<[f64; 2]>]) {
    match free.split_last() {
        None => sweep.visit(state),
        Some((list, before)) => {
            for corner in list {
                sweep.descend(state, first + before.len(), *corner);
                descend_all(sweep, state, first, before);
            }
        }
    }
}
