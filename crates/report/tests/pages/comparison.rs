//! The page of a comparison.

use certune_report::{ComparisonReport, comparison_report};

use crate::markup::{balanced, colours_have_rules, keep_for_a_look};
use crate::synthetic::comparison::comparison;

fn page(record: &ComparisonReport) -> String {
    let html = comparison_report(record).unwrap();
    assert_eq!(balanced(&html).map(|count| count > 100), Ok(true));
    html
}

#[test]
fn look() {
    let html = page(&comparison());
    keep_for_a_look(&html, "comparison");
    eprintln!("{} bytes", html.len());
    colours_have_rules(&html);
}
