//! Cases that follow the increments of other cases.

use super::case::Case;
use super::file::Study;

/// The case that `id` follows.
pub(super) fn of<'a>(study: &'a Study, id: &str) -> Option<&'a str> {
    let follow = study.follow.iter().find(|f| f.cases.iter().any(|c| c == id));
    follow.map(|f| f.of.as_str())
}

/// The history of the case `leader`, as seen from the folder of another.
pub(super) fn history_of(leader: &str) -> String {
    format!("../{leader}/run/history.csv")
}

/// A case that follows two others, or itself in a cycle: key, and what was found.
pub(super) fn fault(study: &Study) -> Option<(String, String)> {
    let named = || study.follow.iter().flat_map(|f| &f.cases);
    for (k, follow) in study.follow.iter().enumerate() {
        for case in &follow.cases {
            let place = || format!("follow[{k}].cases");
            if named().filter(|c| *c == case).count() > 1 {
                return Some((place(), format!("'{case}' more than once")));
            }
            let mut at = case.as_str();
            for _ in named() {
                let Some(next) = of(study, at) else { break };
                at = next;
                if at == case {
                    return Some((place(), format!("'{case}', which follows itself")));
                }
            }
        }
    }
    None
}

/// Groups of cases in order of execution: first those that follow none, then those that follow these, and so on. A case
/// whose leader is not in the list belongs to the first group.
pub(super) fn ranks(cases: &[Case]) -> Vec<Vec<&Case>> {
    let mut ranks: Vec<Vec<&Case>> = Vec::new();
    let mut left: Vec<&Case> = cases.iter().collect();
    while !left.is_empty() {
        let waits =
            |c: &&Case| c.follows.as_ref().is_some_and(|other| left.iter().any(|l| l.id == *other));
        let (later, mut now): (Vec<&Case>, Vec<&Case>) = left.iter().copied().partition(waits);
        if now.is_empty() {
            // A cycle; valid studies have none.
            now.clone_from(&later);
            left.clear();
        } else {
            left = later;
        }
        ranks.push(now);
    }
    ranks
}

/// The `wanted` cases and all cases that they follow.
#[must_use]
pub fn with_leaders(all: &[Case], wanted: impl Fn(&str) -> bool) -> Vec<Case> {
    let mut taken: Vec<bool> = all.iter().map(|c| wanted(&c.id)).collect();
    let leader = |k: usize| {
        let other = all[k].follows.as_ref()?;
        all.iter().position(|c| c.id == *other)
    };
    for k in 0..all.len() {
        let mut at = k;
        while let Some(next) = leader(at).filter(|&next| taken[at] && !taken[next]) {
            taken[next] = true;
            at = next;
        }
    }
    all.iter().zip(taken).filter(|(_, taken)| *taken).map(|(case, _)| case.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn case(id: &str, follows: Option<&str>) -> Case {
        Case {
            id: id.into(),
            options: Vec::new(),
            follows: follows.map(str::to_owned),
            scene: serde_json::Value::Null,
        }
    }

    fn study(follow: serde_json::Value) -> Study {
        let options: Vec<_> =
            ["a", "b", "c"].iter().map(|n| serde_json::json!({"name": n})).collect();
        serde_json::from_value(serde_json::json!({
            "format": "kanagata-study", "version": 1, "name": "s", "watch": "punch", "scene": {},
            "choices": [{"name": "model", "options": options}], "follow": follow
        }))
        .unwrap()
    }

    #[test]
    fn leaders_come_before_those_that_follow_them() {
        let cases = [case("c", Some("b")), case("b", Some("a")), case("a", None), case("d", None)];
        let ids = |rank: &Vec<&Case>| rank.iter().map(|c| c.id.clone()).collect::<Vec<_>>();
        let ranks: Vec<_> = ranks(&cases).iter().map(ids).collect();
        assert_eq!(ranks, [vec!["a", "d"], vec!["b"], vec!["c"]]);
        let wanted = with_leaders(&cases, |id| id == "c");
        assert_eq!(wanted.iter().map(|c| c.id.as_str()).collect::<Vec<_>>(), ["c", "b", "a"]);
    }

    #[test]
    fn no_case_follows_two_or_itself() {
        let follow = |of: &str, cases: &[&str]| serde_json::json!({"of": of, "cases": cases});
        let found = |list: Vec<serde_json::Value>| fault(&study(list.into()));
        assert_eq!(found(vec![follow("a", &["b"]), follow("b", &["c"])]), None);
        let twice = found(vec![follow("a", &["c"]), follow("b", &["c"])]).unwrap();
        assert!(twice.0 == "follow[0].cases" && twice.1.contains("'c' more than once"));
        assert!(found(vec![follow("a", &["a"])]).unwrap().1.contains("follows itself"));
        let circle = found(vec![follow("a", &["b"]), follow("b", &["c"]), follow("c", &["a"])]);
        assert!(circle.unwrap().1.contains("follows itself"));
    }

    #[test]
    fn a_case_names_the_history_it_takes_its_increments_from() {
        let study = study(serde_json::json!([{"of": "a", "cases": ["b"]}]));
        let here = std::path::Path::new("t");
        let roots = super::super::cases::Roots { tools: here, own: here };
        let cases = super::super::cases::cases(&study, &roots, false);
        assert_eq!(cases[1].scene["solver"]["increments_of"], "../a/run/history.csv");
        assert_eq!(cases[1].follows.as_deref(), Some("a"));
        assert!(cases[0].scene.get("solver").is_none());
    }
}
