//! The page of a synthetic run: complete, self-contained, well-formed, and never bolder than its evidence.

use certune_report::{Grade, ReportError, TuningReport, Verdict, tuning_report};

use crate::markup::{balanced, colours_have_rules, keep_for_a_look, words};
use crate::synthetic;

fn page(record: &TuningReport) -> String {
    let html = tuning_report(record).unwrap();
    assert_eq!(balanced(&html).map(|count| count > 100), Ok(true));
    assert!(html.len() < 2_000_000, "{} bytes", html.len());
    html
}

#[test]
fn the_page_is_complete_small_and_loads_nothing() {
    let html = page(&synthetic::record());
    keep_for_a_look(&html, "report");
    for section in synthetic::SECTIONS {
        assert!(html.contains(&format!("<section id=\"{section}\"")), "{section}");
        assert!(section == "answer" || html.contains(&format!("href=\"#{section}\"")), "{section}");
    }
    assert!(html.starts_with("<!doctype html>"));
    assert!(html.len() < 800_000, "{} bytes", html.len());
    for outside in ["http", "src=", "<link", "<img", "url(", "@import", "fetch"] {
        assert!(!html.contains(outside), "{outside}");
    }
    // Seven angles, seven torques; free energy and search twice; two of held-out; sensitivity; shares and two maps; two pole maps;
    // region.
    assert_eq!(html.matches("<svg ").count(), 7 + 7 + 2 * 2 + 2 + 1 + 3 + 2 + 1);
    assert_eq!(html.matches("<svg ").count(), html.matches("role=\"img\" aria-label=\"").count());
    assert_eq!(html.matches("<h1>").count(), 1);
}

#[test]
fn the_answer_comes_first_and_says_what_it_rests_on() {
    let html = page(&synthetic::record());
    let answer = html.split_once("id=\"asked\"").unwrap().0;
    for words in [
        "Panda: tuned gains settle every move in 3.10\u{a0}s instead of 4.09\u{a0}s",
        "on every one of 64 random arms that the search never saw",
        "conditional: holds if the sampled constants hold",
        "every eigenvalue of the inertia matrix lies in 0.0044 to 8.72 kg m²",
        "3 of 5 moves of the scenario start farther from the goal than the certified radius of 1.31\u{a0}rad",
        "On the edge of the search space: kappa_a.",
    ] {
        assert!(answer.contains(words), "{words}");
    }
    assert_eq!(
        answer.matches("every eigenvalue of the inertia matrix").count(),
        1,
        "a shared assumption is listed once"
    );
}

fn section<'a>(html: &'a str, id: &str) -> &'a str {
    let after = html.split_once(&format!("<section id=\"{id}\"")).unwrap().1;
    after.split_once("</section>").unwrap().0
}

#[test]
fn candidates_without_a_cost_are_told_apart() {
    let html = page(&synthetic::record());
    let search = words(section(&html, "search"));
    for outcome in ["given up", "beyond a limit", "unstable", "diverged"] {
        // In the sentence above the figure, and beside its lane in both widths.
        assert_eq!(search.matches(outcome).count(), 3, "{outcome}");
    }
    assert_eq!(search.matches("uncertified").count(), 1, "it has a cost, so it has a dot");
}

#[test]
fn what_was_learnt_is_said_and_drawn() {
    let html = page(&synthetic::record());
    let learnt = section(&html, "learnt").replace("&#x2f;", "/");
    for expected in [
        "84 candidates nearest to the tuned gains, up to 21.0\u{a0}% of each range away: 21 coefficients, R² 0.964, and 0.911",
        "Stiff: kappa_mu up with sigma_mu down. A tenth of the range changes the cost by 0.0520\u{a0}s.",
        "Slack: kappa_mu up with sigma_mu up. The cost hardly changes: 0.00100\u{a0}s",
        "kappa_mu with sigma_mu",
        "On a bound of the search: kappa_a.",
        "The worst held-out arm reaches 18.4 N m/s, 2.10\u{a0}% inside: this limit holds the gains back.",
        "lag 97.2\u{a0}%, jitter 1.80\u{a0}%",
        "Candidate 211, the best until then: settling time 2.41 s.",
        "Stability over kappa_a and sigma_dq",
        "exact arithmetic finds that every linearised loop of the whole box of arms decays",
    ] {
        assert!(learnt.contains(expected), "{expected}");
    }
    assert!(!learnt.contains("kappa_a with kappa_mu"), "two pairs are enough");
    assert!(!learnt.contains("kappa_a up with sigma_dq up"), "neither stiff nor slack");
}

#[test]
fn what_is_not_known_is_not_drawn() {
    let mut record = synthetic::record();
    record.learnt.surface = None;
    record.learnt.no_surface = "12 candidates of one round have a cost".to_owned();
    record.learnt.worst_plants.clear();
    record.learnt.slices[0].certified.clear();
    record.learnt.slices.truncate(1);
    let html = page(&record);
    let learnt = section(&html, "learnt");
    assert!(learnt.contains("The importance of the gains is not known: 12 candidates of one round have a cost."));
    assert!(!learnt.contains("The worst arms") && !learnt.contains("exact arithmetic") && !learnt.contains("Stiff"));
    record.learnt = certune_report::Learnt::default();
    let html = page(&record);
    assert!(section(&html, "learnt").contains("was not measured") && !section(&html, "learnt").contains("<svg"));
}

#[test]
fn a_map_whose_rows_differ_is_refused() {
    let mut record = synthetic::record();
    record.learnt.slices[1].stable[3].pop();
    let error = tuning_report(&record).unwrap_err();
    assert_eq!(error.to_string(), "learnt.slices.stable: expected 24 entries, found 23");
    let mut record = synthetic::record();
    record.learnt.surface.as_mut().unwrap().directions[0].parts.pop();
    assert!(matches!(tuning_report(&record), Err(ReportError::Length { expected: 5, found: 4, .. })));
}

#[test]
fn a_conditional_page_never_says_proved() {
    let html = page(&synthetic::record());
    assert!(!html.to_lowercase().contains("proved"));
    assert!(html.contains("Conditional: holds if the sampled constants hold"));
}

#[test]
fn a_proof_is_called_one_only_when_every_link_is() {
    let mut record = synthetic::record();
    for claim in &mut record.certificate.claims {
        claim.grade = Grade::Proved;
        claim.assumptions.iter_mut().for_each(|assumption| assumption.grade = Some(Grade::Proved));
    }
    let html = page(&record);
    assert!(html.contains("both claims proved") && html.contains(">Proved</span>"));

    record.certificate.claims[0].assumptions[1].grade = Some(Grade::Sampled);
    record.certificate.claims[1].assumptions[2].grade = Some(Grade::Conditional);
    let html = page(&record);
    assert!(!html.to_lowercase().contains("proved"));
    assert!(html.contains("both claims seen to hold in samples only"));
}

#[test]
fn what_the_arm_is_taken_to_be_is_no_weakness_of_a_proof() {
    let mut record = synthetic::record();
    for claim in &mut record.certificate.claims {
        claim.grade = Grade::Proved;
        claim.assumptions.iter_mut().for_each(|assumption| assumption.grade = None);
    }
    let html = page(&record);
    assert!(html.contains("both claims proved") && html.contains(r#"<span class="grade model">model</span>"#));
}

#[test]
fn a_statement_bolder_than_its_evidence_is_refused() {
    let mut record = synthetic::record();
    record.certificate.claims[1].statement = "Convergence is Proved.".to_owned();
    assert!(matches!(tuning_report(&record), Err(ReportError::Overclaim { index: 1, .. })));
    record.certificate.claims[1].verdict = Verdict::NotProved;
    page(&record);
}

#[test]
fn refused_and_open_claims_are_shown_as_such() {
    let mut record = synthetic::record();
    let claim = &mut record.certificate.claims[0];
    claim.verdict = Verdict::Refused;
    claim.counterexample = vec!["q = (0.1, 1.2, 0, −1.4, 0, 2, 0): eigenvalue 0.31 ± 2.2i".to_owned()];
    let html = page(&record);
    assert!(html.contains("1 of 2 claims is refused, with a counterexample"));
    assert!(html.contains("no gains were certified"));
    assert!(html.contains("eigenvalue 0.31 ± 2.2i") && html.contains(">Refused</span>"));

    record.certificate.claims[0].verdict = Verdict::NotProved;
    let html = page(&record);
    assert!(html.contains("1 of 2 claims is not proved and not refuted") && html.contains(">Not proved</span>"));
}

#[test]
fn names_are_text_and_never_markup() {
    let evil = "<script>alert('x')</script>\"&";
    let mut record = synthetic::record();
    record.asked.robot = evil.to_owned();
    record.asked.command = evil.to_owned();
    record.asked.cost.unit = evil.to_owned();
    record.response.joint_names[0] = evil.to_owned();
    record.gains[0].name = evil.to_owned();
    record.sensitivity[0].gain = evil.to_owned();
    record.segments[0].label = evil.to_owned();
    record.search.evaluations[0].phase = evil.to_owned();
    record.search.evaluations[0].outcome = evil.to_owned();
    record.certificate.claims[0].statement = evil.to_owned();
    record.certificate.claims[0].kind = evil.to_owned();
    if let Some(surface) = &mut record.learnt.surface {
        surface.gains[0].gain = evil.to_owned();
    }
    record.learnt.worst_plants[0].in_words = evil.to_owned();
    record.learnt.slices[0].x.gain = evil.to_owned();
    if let Some(region) = &mut record.certificate.region {
        region.steps[0].label = evil.to_owned();
    }
    let html = page(&record);
    assert!(!html.contains("<script>alert") && !html.contains("alert('"));
    assert!(html.contains("&lt;script&gt;"));
}

#[test]
fn missing_and_diverged_numbers_leave_gaps_not_nonsense() {
    let mut record = synthetic::record();
    let run = &mut record.response.runs.published;
    for k in 2000..run.time_s.len() {
        for joint in 0..7 {
            run.q_rad[joint][k] = if k < 2100 { 10_f64.powi(k as i32 - 2000) } else { f64::NAN };
            run.tau_n_m[joint][k] = if k < 2100 { -1e300 } else { f64::NEG_INFINITY };
        }
        run.free_energy[k] = f64::NAN;
    }
    run.diverged_at_s = Some(10.2);
    for segment in &mut record.segments {
        segment.metrics.published = certune_report::SegmentMetrics::default();
        segment.metrics.tuned.itae_rad_s2 = Some(f64::NAN);
    }
    record.held_out.plants[3].cost.published = None;
    record.held_out.plants[4].cost.tuned = Some(f64::NAN);
    record.held_out.bands.published.error_p50_rad[7] = f64::NAN;
    record.search.published_cost = Some(f64::INFINITY);
    record.sensitivity[0].ratio_at_minus_10_percent = None;
    record.sensitivity[1].ratio_at_plus_10_percent = Some(f64::INFINITY);
    record.certificate.claims[0].margins[0].value = None;
    record.certificate.claims[0].verdict = Verdict::Refused;
    record.certificate.claims[0].counterexample = vec!["at q = 0: eigenvalue 0.31 ± 2.2i /s".to_owned()];
    let html = page(&record);
    keep_for_a_look(&html, "report-diverged");
    let words = words(&html);
    assert!(!words.contains("NaN") && !words.contains(" inf"), "a raw float reached the reader");
    for expected in [
        "no gains were certified",
        "ran away after 10.2&nbsp;s",
        ">never</td>",
        ">diverged</td>",
        "−10 %: no cost",
        "With the tuned gains, 1 of 64 held-out arms did not finish the task.",
    ] {
        assert!(html.contains(expected), "{expected}");
    }
    // No coordinate far outside the canvas: the curve of the diverged run ends on the edge of its figure.
    assert!(!html.contains("2147483647") && !html.contains("-2147483648"));
}

#[test]
fn an_empty_record_says_what_is_missing() {
    let mut record: TuningReport = serde_json::from_str(include_str!("../smallest.json")).unwrap();
    record.asked.cost.unit.clear();
    let html = tuning_report(&record).unwrap();
    balanced(&html).unwrap();
    for expected in
        ["no claim was examined", "No held-out arm was simulated", "No candidate was recorded", "Not measured"]
    {
        assert!(html.contains(expected), "{expected}");
    }
}

#[test]
fn many_poles_and_candidates_do_not_make_a_heavy_page() {
    let mut record = synthetic::record();
    let map = record.certificate.pole_map.as_mut().unwrap();
    map.poles.tuned = (0..60_000)
        .map(|k| certune_report::Pole { re: -90.0 * synthetic::noise(k), im: 100.0 * synthetic::noise(k + 1_000_000) })
        .collect();
    let first = record.search.evaluations[300].clone();
    record.search.evaluations.extend((400..20_000).map(|index| certune_report::Evaluation {
        index,
        cost: Some(2.0 + synthetic::noise(index)),
        ..first.clone()
    }));
    assert!(page(&record).len() < 1_200_000);
}

#[test]
fn series_of_unequal_length_are_refused_with_numbers() {
    let mut record = synthetic::record();
    record.response.runs.tuned.tau_n_m[3].pop();
    let error = tuning_report(&record).unwrap_err();
    assert_eq!(error.to_string(), "response.runs.tau_n_m: expected 6000 entries, found 5999");
    let mut record = synthetic::record();
    record.response.joint_names.push("eighth".to_owned());
    assert!(matches!(
        tuning_report(&record),
        Err(ReportError::Length { series: "response.joint_names", expected: 7, found: 8 })
    ));
    let mut record = synthetic::record();
    record.held_out.bands.tuned.error_p95_rad.clear();
    assert!(matches!(tuning_report(&record), Err(ReportError::Length { .. })));
}

#[test]
fn a_record_travels_through_json_and_refuses_unknown_keys() {
    let mut record = synthetic::record();
    let text = serde_json::to_string(&record).unwrap();
    assert_eq!(serde_json::from_str::<TuningReport>(&text).unwrap(), record);
    assert!(serde_json::from_str::<TuningReport>(&text.replacen("\"asked\"", "\"asks\"", 1)).is_err());

    record.response.runs.tuned.q_rad[2][5] = f64::NAN;
    let text = serde_json::to_string(&record).unwrap();
    let back: TuningReport = serde_json::from_str(&text).unwrap();
    assert!(back.response.runs.tuned.q_rad[2][5].is_nan());
}

#[test]
fn a_region_without_a_radius_is_said_to_cover_nothing() {
    let mut record = synthetic::record();
    record.certificate.region.as_mut().unwrap().radius_rad = None;
    let html = page(&record);
    assert!(html.contains("No starting error is certified for the nonlinear arm"));
    assert!(html.contains("Certified radius (none) against the moves") && html.contains("covers 0 of 5 moves"));
}

#[test]
fn every_sentinel_colour_has_a_rule() {
    assert!(colours_have_rules(&page(&synthetic::record())) > 10);
}

#[test]
fn the_same_record_gives_the_same_page() {
    assert_eq!(page(&synthetic::record()), page(&synthetic::record()));
}
