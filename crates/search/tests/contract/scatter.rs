//! What the first look promises.

use certune_search::{Ending, Scatter, Search, SetupError};

use crate::common::{reread, sphere};

#[test]
fn as_many_points_as_ordered_are_asked_all_in_the_box_and_the_best_is_kept() {
    for count in [0, 1, 7, 8, 9, 40] {
        let mut search = Scatter::new(3, count, 5).unwrap();
        let mut scores = Vec::new();
        while search.ended().is_none() {
            let points = search.ask();
            assert_eq!(points, reread(&search).ask(), "a state that was read asks the same");
            assert!(points.iter().flatten().all(|x| (0.0..=1.0).contains(x)));
            let told: Vec<f64> = points.iter().map(|point| sphere(point, &[0.2, 0.4, 0.9])).collect();
            search.tell(&told).unwrap();
            scores.extend(told);
        }
        assert_eq!((scores.len(), search.ended()), (count, Some(Ending::MaxIter)));
        assert_eq!(search.enough(), scores.iter().copied().reduce(f64::min));
    }
    assert_eq!(Scatter::new(0, 3, 1).unwrap_err(), SetupError::NoDimension);
}

#[test]
fn every_corner_of_the_box_is_visited() {
    let mut search = Scatter::new(2, 64, 1).unwrap();
    let mut corners = [0; 4];
    while search.ended().is_none() {
        let points = search.ask();
        points.iter().for_each(|point| corners[2 * usize::from(point[0] > 0.5) + usize::from(point[1] > 0.5)] += 1);
        search.tell(&vec![0.0; points.len()]).unwrap();
    }
    assert!(corners.iter().all(|count| *count > 6), "{corners:?}");
}
