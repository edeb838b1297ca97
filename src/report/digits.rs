//! Figures as people read them: rounded to four significant digits.

/// A number with four significant digits, without zeros at its end; with an exponent where it is below 1e-4 or from 1e6 on.
#[must_use]
pub fn four_digits(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e6).contains(&value.abs()) {
        return format!("{value:.3e}");
    }
    let digits = (3 - value.abs().log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_four_digits() {
        let values = [0.0010000000000000007, 60.0, 1234.5, 0.0, 3e9, 7.802327320671765e-6, -0.25];
        let expected = ["0.001", "60", "1234", "0", "3.000e9", "7.802e-6", "-0.25"];
        assert_eq!(values.map(four_digits), expected);
        assert_eq!([100.0 / 3.0, 100.0 * 0.07].map(four_digits), ["33.33", "7"]);
    }
}
