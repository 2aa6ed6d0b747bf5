//! Two goals at once: a front, and a point of it.

use crate::common::{SHORT, json, stdout};

#[test]
fn a_front_is_certified_and_any_point_can_be_picked() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("short.toml"), SHORT).unwrap();
    let line = |out: &str, threads: usize| {
        format!(
            "front --robot panda --scenario short.toml --goals settling-cost,jitter --budget 60 --plants 2 --threads {threads} --out {out}"
        )
    };
    let made = json(folder.path(), &line("one", 1), 0);
    let points = made["points"].as_array().unwrap();
    assert!(points.len() >= 3, "{}", points.len());
    let figure = |point: usize, goal: usize| points[point]["figures"][goal].as_f64().unwrap();
    for point in 1..points.len() {
        assert!(figure(point - 1, 0) < figure(point, 0) && figure(point - 1, 1) > figure(point, 1), "not a front");
    }
    let read = |path: &str| std::fs::read_to_string(folder.path().join(path)).unwrap();
    stdout(folder.path(), &line("two", 2), 0);
    assert_eq!(read("one/front.json"), read("two/front.json"));
    let page = read("one/front.html");
    assert_eq!(page.matches("<tr id=\"point-").count(), points.len());

    let picked = json(folder.path(), "pick one --point 2", 0);
    assert_eq!(picked["gains"], points[1]["gains"]);
    stdout(folder.path(), "verify one/point-2/certificate.json", 0);
    stdout(folder.path(), "simulate --robot panda --gains one/point-2/gains.toml --scenario short.toml", 0);
    // Again, over what is there.
    stdout(folder.path(), "pick one --point 2", 0);
}
