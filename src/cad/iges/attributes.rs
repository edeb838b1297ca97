//! Names, levels, groups and colours: fields of the directory, properties (406), groups (402) and colours (314).

use std::sync::Arc;

use super::marks::Marks;
use super::reader::Reader;
use crate::attributes::{Attributes, BASIC_COLOURS, Name, Style, name, rgb};

/// Largest number of property pointers at the end of a record that are looked for.
const PROPERTIES_MAX: usize = 16;

/// Largest number of layers and groups of one entity that are kept.
const LAYERS_MAX: usize = 64;

impl Reader<'_, '_> {
    /// Name, layers and colour of an entity; its body is not known yet.
    pub(super) fn attributes_of(&self, entity: usize) -> Arc<Attributes> {
        let Style { layers, colour } = self.style(entity);
        Arc::new(Attributes { body: 0, name: self.name_of(entity), layers, colour })
    }

    /// Layers and colour of an entity.
    pub(super) fn style(&self, entity: usize) -> Style {
        let marks = self.marks();
        let level = marks.levels.get(&self.file.entry(entity).level);
        let groups = marks.groups.get(&entity);
        let names = [level, groups].into_iter().flatten().flatten().take(LAYERS_MAX);
        Style { layers: names.cloned().collect(), colour: self.colour(entity) }
    }

    /// Name of an entity: its name property (406 form 15: NP, name), otherwise its label in the directory.
    pub(super) fn name_of(&self, entity: usize) -> Option<Name> {
        let has_names = self.marks.get().is_none_or(|marks| marks.has_names);
        let properties = if has_names { self.properties(entity) } else { Vec::new() };
        let mut names = properties.into_iter().filter(|p| {
            let entry = self.file.entry(*p);
            entry.kind == 406 && entry.form == 15
        });
        let given = names.next().and_then(|property| {
            let mut p = self.file.params(property).ok()?;
            p.skip();
            name(&p.text())
        });
        given.or_else(|| name(&self.file.entry(entity).label))
    }

    /// Properties of an entity: the last list of its record, with its length in front.
    fn properties(&self, entity: usize) -> Vec<usize> {
        let Ok(p) = self.file.params(entity) else { return Vec::new() };
        let tail = p.tail(PROPERTIES_MAX + 1);
        let find = |n: usize| {
            let (pointers, before) = (tail.get(tail.len() - n..)?, tail.len().checked_sub(n + 1)?);
            let is_count = tail[before] == i64::try_from(n).ok();
            let all: Option<Vec<usize>> =
                pointers.iter().map(|p| self.file.directory.find((*p)?)).collect();
            let is_property = |e: &usize| matches!(self.file.entry(*e).kind, 406 | 422);
            all.filter(|all| is_count && all.iter().all(is_property))
        };
        (1..tail.len()).find_map(find).unwrap_or_default()
    }

    /// Colour of the directory entry: a basic colour, or a definition (314: three percentages).
    fn colour(&self, entity: usize) -> Option<[u8; 3]> {
        let number = self.file.entry(entity).colour;
        if number > 0 {
            return BASIC_COLOURS.get(usize::try_from(number).ok()? - 1).map(|c| c.1);
        }
        let definition = self.file.directory.find(i64::from(number)).filter(|_| number < 0)?;
        if self.file.entry(definition).kind != 314 {
            return None;
        }
        let mut p = self.file.params(definition).ok()?;
        let mut part = || p.real("colour").ok().map(|percent| percent / 100.0);
        rgb([part()?, part()?, part()?])
    }

    fn marks(&self) -> &Marks {
        self.marks.get_or_init(|| self.read_marks())
    }

    fn read_marks(&self) -> Marks {
        let mut marks = Marks::default();
        let entries = &self.file.directory.entries;
        marks.has_names = entries.iter().any(|e| e.kind == 406 && e.form == 15);
        for (entity, entry) in entries.iter().enumerate() {
            let level = entry.level;
            if level != 0 && !marks.levels.contains_key(&level) {
                marks.levels.insert(level, self.levels(level));
            }
            if entry.kind == 402 {
                let members = self.group(entity).unwrap_or_default();
                let own = self.name_of(entity);
                let own = own.unwrap_or_else(|| format!("group D{}", entry.pointer).into());
                for member in members {
                    let names = marks.groups.entry(member).or_default();
                    if names.last() != Some(&own) {
                        names.push(Arc::clone(&own));
                    }
                }
            }
        }
        marks
    }

    /// Levels of a level field: a number, or a list of them (406 form 1: NP, levels).
    fn levels(&self, field: i32) -> Vec<Name> {
        if field > 0 {
            return vec![field.to_string().into()];
        }
        let listed = || {
            let list = self.file.directory.find(i64::from(field))?;
            let entry = self.file.entry(list);
            let mut p =
                self.file.params(list).ok().filter(|_| entry.kind == 406 && entry.form == 1)?;
            let count = p.count("number of levels", 1).ok()?;
            let mut level = || Some(p.integer_or("level", 0).ok()?.to_string().into());
            (0..count).map(|_| level()).collect::<Option<Vec<Name>>>()
        };
        listed().unwrap_or_default()
    }
}
