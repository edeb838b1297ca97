//! Cursor over the parameters of an entity, with validated defaults, counts and pointers.

use super::file::{Fault, File};
use super::token::{self, Token, integer, real};
use kanagata_geometry::Vec3;

/// Parameters of one entity; fields are numbered from 1 after the type number.
pub(super) struct Params<'f, 'a> {
    file: &'f File<'a>,
    /// The entity they belong to.
    pub entity: usize,
    tokens: Vec<Token<'f>>,
    at: usize,
    /// Offset of `text` in the parameter section.
    offset: usize,
    text: &'f [u8],
}

impl<'a> File<'a> {
    /// The parameters of an entity, after its type number.
    ///
    /// # Errors
    /// A fault when there are none, or the work budget is exhausted (self-multiplying pointers).
    pub fn params(&self, entity: usize) -> Result<Params<'_, 'a>, Fault> {
        let entry = self.entry(entity);
        let cards = &self.cards().parameter_cards;
        let Some(first) = cards.get(entry.cards.start).filter(|_| !entry.cards.is_empty()) else {
            return Err(self.fault(
                entity,
                "parameters-missing",
                "no parameter card starts with the type number of this entity",
                "a parameter pointer (field 2) to its first card",
            ));
        };
        let end = cards.get(entry.cards.end).map_or(self.cards().parameters.len(), |c| c.offset);
        let text = self.cards().parameters.get(first.offset..end).unwrap_or_default();
        let (tokens, closed) = token::record(text, self.global.delimiters);
        self.charge(entity, tokens.len() + 1)?;
        if !closed {
            self.note(
                entity,
                "record-not-closed",
                "the record has no record delimiter; read to the next one",
            );
        }
        Ok(Params::new(self, entity, tokens, first.offset, text))
    }
}

impl<'f, 'a> Params<'f, 'a> {
    fn new(
        file: &'f File<'a>,
        entity: usize,
        tokens: Vec<Token<'f>>,
        offset: usize,
        text: &'f [u8],
    ) -> Self {
        Self { file, entity, tokens, at: 1, offset, text }
    }

    /// Number of parameters not yet read.
    pub fn remaining(&self) -> usize {
        self.tokens.len().saturating_sub(self.at)
    }

    fn next(&mut self) -> Token<'f> {
        let token = self.tokens.get(self.at).copied().unwrap_or(Token::Blank);
        self.at += 1;
        token
    }

    /// Skips a parameter.
    pub fn skip(&mut self) {
        self.at += 1;
    }

    /// A fault located at the last parameter read.
    pub fn fault(&self, found: impl std::fmt::Display, allowed: &str) -> Fault {
        let token = self.tokens.get(self.at.saturating_sub(1));
        let offset = match token {
            Some(Token::Word(w) | Token::Text(w)) => (w.as_ptr() as usize)
                .checked_sub(self.text.as_ptr() as usize)
                .map(|o| o + self.offset),
            _ => None,
        };
        Fault {
            code: "entity-invalid",
            place: self.file.place(self.entity, offset),
            found: format!("parameter {} ({found})", self.at.saturating_sub(1)),
            allowed: allowed.to_owned(),
        }
    }

    fn malformed(&self, what: &str, token: Token<'_>, allowed: &str) -> Fault {
        let (Token::Word(text) | Token::Text(text)) = token else {
            return self.fault(format_args!("{what}) is blank"), allowed);
        };
        let shown = String::from_utf8_lossy(text.get(..text.len().min(40)).unwrap_or_default())
            .into_owned();
        let mut fault = self.fault(what, allowed);
        fault.found = format!("{} is `{shown}`", fault.found);
        fault
    }

    /// A real; blank is 0.
    pub fn real(&mut self, what: &str) -> Result<f64, Fault> {
        self.real_or(what, 0.0)
    }

    /// A real; blank or missing is `default`.
    pub fn real_or(&mut self, what: &str, default: f64) -> Result<f64, Fault> {
        match self.next() {
            Token::Blank => Ok(default),
            Token::Word(word) => {
                real(word).ok_or_else(|| self.malformed(what, Token::Word(word), "a finite number"))
            }
            token @ Token::Text(_) => Err(self.malformed(what, token, "a finite number")),
        }
    }

    /// An integer; blank or missing is `default`.
    pub fn integer_or(&mut self, what: &str, default: i64) -> Result<i64, Fault> {
        match self.next() {
            Token::Blank => Ok(default),
            Token::Word(word) => {
                integer(word).ok_or_else(|| self.malformed(what, Token::Word(word), "an integer"))
            }
            token @ Token::Text(_) => Err(self.malformed(what, token, "an integer")),
        }
    }

    /// A flag: true for any integer but 0; blank is `default`.
    pub fn flag(&mut self, what: &str, default: bool) -> Result<bool, Fault> {
        Ok(self.integer_or(what, i64::from(default))? != 0)
    }

    /// A count of items with `each` parameters. It is checked against the remaining record, so that no declared count
    /// determines an allocation. Two parameters may be missing at the end (defaults).
    pub fn count(&mut self, what: &str, each: usize) -> Result<usize, Fault> {
        let declared = self.integer_or(what, 0)?;
        let held = (self.remaining() + 2) / each.max(1);
        usize::try_from(declared).ok().filter(|n| *n <= held).ok_or_else(|| {
            let mut fault = self.fault(what, &format!("0 to {held}, what the record can hold"));
            fault.found = format!("{} is {declared}", fault.found);
            fault
        })
    }

    /// Fails unless `count` more parameters are present (two may be missing at the end).
    pub fn expect(&self, count: usize, what: &str) -> Result<(), Fault> {
        if count <= self.remaining() + 2 {
            return Ok(());
        }
        let mut fault = self.fault(what, "a record that holds what its counts declare");
        fault.found = format!("{what}: {count} parameters declared, {} there", self.remaining());
        Err(fault)
    }

    /// A text; empty for other values.
    pub fn text(&mut self) -> String {
        match self.next() {
            Token::Text(text) | Token::Word(text) => String::from_utf8_lossy(text).into_owned(),
            Token::Blank => String::new(),
        }
    }

    /// The last `count` parameters or fewer, after the type number; `None` for other values than integers.
    pub fn tail(&self, count: usize) -> Vec<Option<i64>> {
        let first = self.tokens.len().saturating_sub(count).max(1);
        let value = |token: &Token<'_>| match token {
            Token::Word(word) => integer(word),
            _ => None,
        };
        self.tokens.iter().skip(first).map(value).collect()
    }

    /// A pointer to an entity; `None` for 0 or blank.
    pub fn pointer_or_none(&mut self, what: &str) -> Result<Option<usize>, Fault> {
        let value = self.integer_or(what, 0)?;
        if value == 0 {
            return Ok(None);
        }
        self.file.directory.find(value).map(Some).ok_or_else(|| {
            let mut fault = self.fault(what, "the sequence number of a directory entry (odd)");
            fault.found = format!("{} points to D{value}, which is not an entry", fault.found);
            fault
        })
    }

    /// A pointer to an entity.
    pub fn pointer(&mut self, what: &str) -> Result<usize, Fault> {
        self.pointer_or_none(what)?.ok_or_else(|| {
            let mut fault = self.fault(what, "the sequence number of a directory entry (odd)");
            fault.found = format!("{} is 0", fault.found);
            fault
        })
    }

    /// Three reals.
    pub fn vec3(&mut self, what: &str) -> Result<Vec3, Fault> {
        Ok(Vec3::new(self.real(what)?, self.real(what)?, self.real(what)?))
    }

    /// `count` reals. The caller has checked the count with [`Params::expect`].
    pub fn reals(&mut self, count: usize, what: &str) -> Result<Vec<f64>, Fault> {
        (0..count).map(|_| self.real(what)).collect()
    }

    /// Points of `count` triples. The caller has checked the count.
    pub fn points(&mut self, count: usize, what: &str) -> Result<Vec<Vec3>, Fault> {
        (0..count).map(|_| self.vec3(what)).collect()
    }
}
