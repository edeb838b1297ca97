//! Names with wildcards.

/// True when `text` fits `pattern`: `*` stands for any characters, `?` for one. The time is bounded by the product of
/// both lengths.
pub(super) fn fits(pattern: &[char], text: &[char]) -> bool {
    let (mut p, mut t) = (0, 0);
    // Where to continue behind the last `*`: one character more belongs to it at each return.
    let mut back: Option<(usize, usize)> = None;
    while t < text.len() {
        match pattern.get(p) {
            Some('*') => {
                back = Some((p + 1, t));
                p += 1;
            }
            Some(c) if *c == '?' || *c == text[t] => {
                p += 1;
                t += 1;
            }
            _ => {
                let Some((behind, from)) = back else { return false };
                back = Some((behind, from + 1));
                (p, t) = (behind, from + 1);
            }
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

#[cfg(test)]
mod tests {
    use super::fits;

    #[test]
    fn stars_and_question_marks_stand_for_characters() {
        let chars = |text: &str| text.chars().collect::<Vec<char>>();
        let is = |pattern: &str, text: &str| fits(&chars(pattern), &chars(text));
        let fitting = [
            ("die", "die"),
            ("*", ""),
            ("d*e", "de"),
            ("d*e*", "dieder"),
            ("*ab", "aab"),
            ("?ie", "die"),
            ("**", "x"),
        ];
        let other =
            [("die", "dies"), ("?", ""), ("d*e", "dies"), ("", "x"), ("*ab", "abc"), ("?ie", "ie")];
        assert!(fitting.iter().all(|(p, t)| is(p, t)), "{fitting:?}");
        assert!(!other.iter().any(|(p, t)| is(p, t)), "{other:?}");
        let many = "a*".repeat(200) + "b";
        assert!(!is(&many, &"a".repeat(400)));
    }
}
