//! Values of options: what they may be, and what is said when they are not.

use certune::TorqueLimits;
use certune::closed_loop::file::nearest;
use certune::closed_loop::simulate::MAX_DELAY_SAMPLES;
use certune::tune::Goal;
use certune::verify::ClaimKind;

/// A closed interval of numbers that are not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval(pub [f64; 2]);

/// A list of finite numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Numbers(pub Vec<f64>);

fn finite(text: &str) -> Result<f64, String> {
    let number: f64 = text.trim().parse().map_err(|_| format!("`{}` is not a number", text.trim()))?;
    if number.is_finite() { Ok(number) } else { Err(format!("`{}` is not a finite number", text.trim())) }
}

pub fn non_negative(text: &str) -> Result<f64, String> {
    finite(text)
        .and_then(|number| if number >= 0.0 { Ok(number) } else { Err("expected a number, zero or above".to_owned()) })
}

pub fn share(text: &str) -> Result<f64, String> {
    non_negative(text).and_then(|number| {
        if number < 1.0 { Ok(number) } else { Err("expected a share of at least 0 and below 1".to_owned()) }
    })
}

pub fn interval(text: &str) -> Result<Interval, String> {
    let Some((low, high)) = text.split_once("..") else {
        return non_negative(text).map(|number| Interval([number, number]));
    };
    let (low, high) = (non_negative(low)?, non_negative(high)?);
    if low <= high {
        Ok(Interval([low, high]))
    } else {
        Err(format!("{low} is above {high}; write the smaller number first"))
    }
}

pub fn numbers(text: &str) -> Result<Numbers, String> {
    let entries = text.split(',').enumerate();
    let numbers = entries.map(|(index, entry)| finite(entry).map_err(|error| format!("entry {}: {error}", index + 1)));
    numbers.collect::<Result<_, _>>().map(Numbers)
}

pub fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("at least 1 thread is needed".to_owned()),
        Ok(count) if count > 1024 => Err("at most 1024 threads are supported".to_owned()),
        Ok(count) => Ok(count),
        Err(_) => Err("expected a number of threads, 1 or more".to_owned()),
    }
}

/// Plants of a search: fewer than anybody would wait for.
pub fn plants(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("at least 1 plant is needed".to_owned()),
        Ok(count) if count > 10_000 => Err("at most 10000 plants are supported".to_owned()),
        Ok(count) => Ok(count),
        Err(_) => Err("expected a number of plants, 1 or more".to_owned()),
    }
}

/// An objective by its name.
pub fn objective(text: &str) -> Result<Goal, String> {
    let names = || Goal::ALL.iter().map(|objective| objective.name());
    Goal::ALL.into_iter().find(|objective| objective.name() == text).ok_or_else(|| {
        let meant = nearest(text, names()).map(|nearest| format!("did you mean `{nearest}`? ")).unwrap_or_default();
        format!("no such objective; {meant}the objectives are {}", names().collect::<Vec<_>>().join(", "))
    })
}

/// A claim by its name.
pub fn claim(text: &str) -> Result<ClaimKind, String> {
    let name = text.trim();
    let names = || ClaimKind::ALL.iter().map(|kind| kind.name());
    ClaimKind::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
        let meant = nearest(name, names()).map(|nearest| format!("did you mean `{nearest}`? ")).unwrap_or_default();
        format!("no such claim; {meant}the claims are {}", names().collect::<Vec<_>>().join(", "))
    })
}

pub fn delay(text: &str) -> Result<usize, String> {
    let expected = || format!("expected a whole number of samples, from 0 to {MAX_DELAY_SAMPLES}");
    text.trim().parse().ok().filter(|samples| *samples <= MAX_DELAY_SAMPLES).ok_or_else(expected)
}

/// What `--torque-limits` means without a value.
pub const ARMS_OWN: &str = "arm";

pub fn torque_limits(text: &str) -> Result<TorqueLimits, String> {
    if text == ARMS_OWN {
        return Ok(TorqueLimits::LessGravity);
    }
    match finite(text) {
        Ok(limit) if limit > 0.0 => Ok(TorqueLimits::Norm(limit)),
        Ok(_) => Err("expected a torque above zero, in N m".to_owned()),
        Err(error) => Err(format!("{error}; expected a torque in N m, or nothing for the arm's own limits")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_is_a_number_or_two() {
        assert_eq!(interval("1.5"), Ok(Interval([1.5, 1.5])));
        assert_eq!(interval("0.5..2"), Ok(Interval([0.5, 2.0])));
        for bad in ["", "-1", "2..1", "1..", "..2", "a..b", "nan", "0..inf", "1...2"] {
            assert!(interval(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_list_names_the_entry_that_is_no_number() {
        assert_eq!(numbers("-1, 0,2e-1"), Ok(Numbers(vec![-1.0, 0.0, 0.2])));
        assert_eq!(numbers("0,x,1"), Err("entry 2: `x` is not a number".to_owned()));
        assert!(numbers("0,,1").is_err() && numbers("").is_err() && numbers("nan").is_err());
    }

    #[test]
    fn a_claim_that_is_none_is_answered_with_the_nearest() {
        assert_eq!(claim("region"), Ok(ClaimKind::Region));
        let message = claim("exponental").expect_err("a misspelling");
        assert!(message.contains("did you mean `exponential`?") && message.contains("pi-exponential"), "{message}");
    }

    #[test]
    fn a_delay_is_a_count_and_a_torque_is_positive() {
        assert_eq!(delay("2"), Ok(2));
        assert_eq!(torque_limits("87"), Ok(TorqueLimits::Norm(87.0)));
        for bad in ["-1", "1.5", "99", "one", ""] {
            assert!(delay(bad).is_err(), "{bad}");
        }
        for bad in ["0", "-3", "inf", "all"] {
            assert!(torque_limits(bad).is_err(), "{bad}");
        }
    }
}
