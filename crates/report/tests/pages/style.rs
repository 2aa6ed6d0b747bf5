//! Colours stand out from the paper and from each other, for every kind of colour vision.

use certune_report::tuning_report;

use crate::synthetic;

const CONTROLLERS: [&str; 7] =
    ["aic-published", "aic-tuned", "aic-other", "mrac-code", "mrac-paper", "mrac-tuned", "baseline"];

/// Linear red, green and blue of `#rrggbb`, WCAG 2.
fn linear(hex: &str) -> [f64; 3] {
    [0, 2, 4].map(|at| {
        let level = f64::from(u8::from_str_radix(&hex[at..at + 2], 16).unwrap()) / 255.0;
        if level <= 0.040_45 { level / 12.92 } else { ((level + 0.055) / 1.055).powf(2.4) }
    })
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn luminance(hex: &str) -> f64 {
    dot([0.2126, 0.7152, 0.0722], linear(hex))
}

/// What eyes without red, green or blue cones see; Machado, Oliveira, Fernandes (2009), severity 1.
const EYES: [[[f64; 3]; 3]; 4] = [
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    [[0.152_286, 1.052_583, -0.204_868], [0.114_503, 0.786_281, 0.099_216], [-0.003_882, -0.048_116, 1.051_998]],
    [[0.367_322, 0.860_646, -0.227_968], [0.280_085, 0.672_501, 0.047_413], [-0.011_820, 0.042_940, 0.968_881]],
    [[1.255_528, -0.076_749, -0.178_779], [-0.078_411, 0.930_809, 0.147_602], [0.004_733, 0.691_367, 0.303_900]],
];

/// CIELAB under D65 of linear red, green and blue.
fn lab(rgb: [f64; 3]) -> [f64; 3] {
    let rgb = rgb.map(|level| level.clamp(0.0, 1.0));
    let xyz = [
        dot([0.4124, 0.3576, 0.1805], rgb) / 0.95047,
        dot([0.2126, 0.7152, 0.0722], rgb),
        dot([0.0193, 0.1192, 0.9505], rgb) / 1.08883,
    ];
    let [x, y, z] = xyz.map(|t| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The two themes of the style sheet.
fn themes() -> Vec<String> {
    let html = tuning_report(&synthetic::record()).unwrap();
    let themes: Vec<_> = html.split(":root {").skip(1).map(|rest| rest.split_once('}').unwrap().0.to_owned()).collect();
    assert_eq!(themes.len(), 2);
    themes
}

fn hex<'a>(theme: &'a str, name: &str) -> &'a str {
    &theme.split_once(&format!("--{name}: #")).unwrap().1[..6]
}

#[test]
fn words_and_curves_stand_out_in_light_and_dark() {
    for theme in themes() {
        let contrast = |name: &str, ground: &str| {
            let (a, b) = (luminance(hex(&theme, name)), luminance(hex(&theme, ground)));
            (a.max(b) + 0.05) / (a.min(b) + 0.05)
        };
        let inks = CONTROLLERS.map(|name| format!("{name}-ink"));
        let words = ["ink", "muted", "axis", "tuned-ink", "published-ink", "certified-ink", "outside-ink", "open-ink"];
        for name in words.into_iter().chain(inks.iter().map(String::as_str)) {
            assert!(contrast(name, "paper") >= 4.5, "{name}: {:.2}", contrast(name, "paper"));
        }
        let curves = ["tuned", "published", "goal", "certified", "outside", "candidate"];
        for name in curves.into_iter().chain(CONTROLLERS) {
            assert!(contrast(name, "paper") >= 3.0, "{name}: {:.2}", contrast(name, "paper"));
        }
        assert!(contrast("ink", "raised") >= 7.0);
    }
}

#[test]
fn controllers_are_told_apart_by_every_eye() {
    for theme in themes() {
        for (eye, matrix) in EYES.iter().enumerate() {
            let seen = CONTROLLERS.map(|name| (name, lab(matrix.map(|row| dot(row, linear(hex(&theme, name)))))));
            for (index, (a, from)) in seen.iter().enumerate() {
                for (b, to) in &seen[index + 1..] {
                    let gap = from.iter().zip(to).map(|(from, to)| (from - to).powi(2)).sum::<f64>().sqrt();
                    // Two colours are just told apart at a distance of 2.3.
                    assert!(gap >= 11.0, "eye {eye}: {a} and {b} are {gap:.1} apart");
                }
            }
        }
    }
}
