//! A low-discrepancy sequence: points that fill a cube evenly, the same on every machine and for every thread count.
//!
//! Point `k` of the Kronecker (Richtmyer) sequence in `d` dimensions is `u_j = frac((k + 1) sqrt(p_j))`, `p_j` the j-th prime. The
//! roots are linearly independent over the rationals, so the points equidistribute (Weyl); any point is computed on its own,
//! which suits threads. Source: Richtmyer, *The evaluation of definite integrals* (1951); Niederreiter,
//! *Random Number Generation and Quasi-Monte Carlo Methods* (1992), ch. 3. Limits: `k` below 2^40, or the product loses its
//! fraction to rounding.

/// The roots that generate a sequence of a given dimension.
#[derive(Clone, Debug)]
pub(crate) struct Kronecker {
    roots: Vec<f64>,
}

impl Kronecker {
    /// The sequence in `dimension` coordinates.
    pub(crate) fn new(dimension: usize) -> Self {
        let mut primes: Vec<u32> = Vec::with_capacity(dimension);
        let mut candidate = 2_u32;
        while primes.len() < dimension {
            if primes.iter().all(|p| !candidate.is_multiple_of(*p)) {
                primes.push(candidate);
            }
            candidate += 1;
        }
        Self { roots: primes.into_iter().map(|p| f64::from(p).sqrt()).collect() }
    }

    /// Point `index`, every coordinate in `[0, 1)`.
    pub(crate) fn point(&self, index: usize) -> impl Iterator<Item = f64> + '_ {
        let k = index as f64 + 1.0;
        self.roots.iter().map(move |root| (k * root).fract())
    }
}

#[cfg(test)]
mod tests {
    use super::Kronecker;

    #[test]
    fn every_cell_of_a_coarse_grid_holds_its_share_of_the_points() {
        const POINTS: usize = 4096;
        const CELLS: usize = 8;
        let sequence = Kronecker::new(9);
        for (a, b) in [(0, 1), (2, 5), (3, 8), (6, 7)] {
            let mut count = [[0_usize; CELLS]; CELLS];
            for k in 0..POINTS {
                let u: Vec<f64> = sequence.point(k).collect();
                assert!(u.iter().all(|x| (0.0..1.0).contains(x)));
                count[(u[a] * CELLS as f64) as usize][(u[b] * CELLS as f64) as usize] += 1;
            }
            let share = POINTS / (CELLS * CELLS);
            // Independent draws would scatter by sqrt(64) = 8 around 64 and reach beyond +-24 in one of 64 cells now and then.
            for cell in count.iter().flatten() {
                assert!(cell.abs_diff(share) <= 20, "{cell} points where {share} belong, axes {a} and {b}");
            }
        }
    }
}
