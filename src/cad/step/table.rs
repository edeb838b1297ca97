//! Instances of a file: parsed once into flat arrays, found by id, read without copying.

use rustc_hash::FxHashMap;

use super::lexer::{Token, blank, token};
use crate::CadError;

/// Maximum nesting depth of lists.
const LIST_DEPTH_MAX: usize = 100;

/// A contiguous range of one of the table's arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Span {
    start: u32,
    end: u32,
}

/// An attribute's value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value<'a> {
    /// `$`
    Missing,
    /// `*`
    Derived,
    /// Whole number.
    Integer(i64),
    /// Real number, finite.
    Real(f64),
    /// String, escapes not decoded.
    Text(&'a [u8]),
    /// Enumeration without its dots.
    Enumeration(&'a str),
    /// Binary data or resource.
    Opaque,
    /// `#id`.
    Reference(u64),
    /// List: values in [`Table::values`].
    List(Span),
    /// `LENGTH_MEASURE(1.)`: index of a part.
    Typed(u32),
}

/// Keyword and attributes: a simple instance has one, a complex one several.
#[derive(Debug, Clone, Copy)]
pub struct Part<'a> {
    /// Keyword.
    pub keyword: &'a str,
    /// Attributes.
    pub values: Span,
}

#[derive(Debug, Clone, Copy)]
struct Instance {
    id: u64,
    parts: Span,
}

/// Everything between `ISO-10303-21;` and `END-ISO-10303-21;`.
#[derive(Debug, Default)]
pub struct Table<'a> {
    header: Vec<Part<'a>>,
    instances: Vec<Instance>,
    parts: Vec<Part<'a>>,
    values: Vec<Value<'a>>,
    index: FxHashMap<u64, u32>,
    /// Ids of more than one instance (the first one is used).
    pub repeated: Vec<u64>,
    /// The text ends before `END-ISO-10303-21;` or `ENDSEC;`.
    pub unfinished: bool,
}

impl<'a> Table<'a> {
    /// Header entities.
    #[must_use]
    pub fn header(&self) -> &[Part<'a>] {
        &self.header
    }

    /// Number of instances.
    #[must_use]
    pub fn len(&self) -> usize {
        self.instances.len()
    }

    /// Index of the instance with this id.
    #[must_use]
    pub fn find(&self, id: u64) -> Option<u32> {
        self.index.get(&id).copied()
    }

    /// Id of the instance at this index.
    #[must_use]
    pub fn id(&self, index: u32) -> u64 {
        self.instances.get(index as usize).map_or(0, |i| i.id)
    }

    /// Parts of the instance at this index.
    #[must_use]
    pub fn parts(&self, index: u32) -> &[Part<'a>] {
        let span = self.instances.get(index as usize).map_or(Span::default(), |i| i.parts);
        self.parts.get(span.start as usize..span.end as usize).unwrap_or(&[])
    }

    /// Values of a list or part.
    #[must_use]
    pub fn values(&self, span: Span) -> &[Value<'a>] {
        self.values.get(span.start as usize..span.end as usize).unwrap_or(&[])
    }

    /// The part of a [`Value::Typed`].
    #[must_use]
    pub fn typed(&self, part: u32) -> Option<&Part<'a>> {
        self.parts.get(part as usize)
    }
}

/// Parses an entire file.
///
/// # Errors
/// [`CadError::Invalid`] with the line of the syntax error.
pub fn parse<'a>(bytes: &'a [u8], name: &str) -> Result<Table<'a>, CadError> {
    let start = find(bytes, b"ISO-10303-21").unwrap_or(0);
    let rest = bytes.get(start..).unwrap_or(&[]);
    let table = Table::default();
    let (pending, lists, parts) = (vec![], vec![], vec![]);
    let mut parser = Parser { file: name, bytes, rest, table, pending, lists, parts };
    parser.expect(|t| matches!(t, Token::Keyword("ISO-10303-21")), "ISO-10303-21;")?;
    parser.expect(|t| *t == Token::Semicolon, "`;`")?;
    while parser.section()? {}
    let mut table = parser.table;
    table.index.reserve(table.instances.len());
    for (k, instance) in (0..).zip(&table.instances) {
        if *table.index.entry(instance.id).or_insert(k) != k {
            table.repeated.push(instance.id);
        }
    }
    Ok(table)
}

fn find(bytes: &[u8], word: &[u8]) -> Option<usize> {
    bytes.windows(word.len()).position(|w| w == word)
}

struct Parser<'a, 'n> {
    file: &'n str,
    bytes: &'a [u8],
    rest: &'a [u8],
    table: Table<'a>,
    /// Values of the open lists.
    pending: Vec<Value<'a>>,
    /// Start of the values of each open list, and the preceding keyword.
    lists: Vec<(usize, Option<&'a str>)>,
    /// Parts of the current instance.
    parts: Vec<Part<'a>>,
}

impl<'a> Parser<'a, '_> {
    /// Reads one section; false at the end of the file.
    fn section(&mut self) -> Result<bool, CadError> {
        if blank(self.rest).is_empty() {
            self.table.unfinished = true;
            return Ok(false);
        }
        match self.next()? {
            Token::Keyword("HEADER") => self.header()?,
            Token::Keyword("DATA") => self.data()?,
            Token::Keyword("END-ISO-10303-21") => return Ok(false),
            Token::Keyword(_) => {
                let end = find(self.rest, b"ENDSEC").ok_or_else(|| {
                    self.fault("a section without ENDSEC;", "ENDSEC; after every section")
                })?;
                self.rest = self.rest.get(end + 6..).unwrap_or(&[]);
                self.semicolon()?;
            }
            other => return Err(self.unexpected(other, "HEADER;, DATA; or END-ISO-10303-21;")),
        }
        Ok(true)
    }

    fn header(&mut self) -> Result<(), CadError> {
        self.semicolon()?;
        loop {
            match self.next()? {
                Token::Keyword("ENDSEC") => return self.semicolon(),
                Token::Keyword(keyword) => {
                    self.open()?;
                    let values = self.list()?;
                    self.table.header.push(Part { keyword, values });
                    self.semicolon()?;
                }
                other => return Err(self.unexpected(other, "a header entity or ENDSEC;")),
            }
        }
    }

    fn data(&mut self) -> Result<(), CadError> {
        match self.next()? {
            Token::Open => {
                self.list()?;
                self.semicolon()?;
            }
            Token::Semicolon => {}
            other => return Err(self.unexpected(other, "DATA;")),
        }
        loop {
            if blank(self.rest).is_empty() {
                self.table.unfinished = true;
                return Ok(());
            }
            match self.next()? {
                Token::Id(id) => self.instance(id)?,
                Token::Keyword("ENDSEC") => return self.semicolon(),
                // `ENDSCOPE`: the scope's contents were read like other instances.
                other => return Err(self.unexpected(other, "#id = or ENDSEC;")),
            }
        }
    }

    fn instance(&mut self, id: u64) -> Result<(), CadError> {
        self.expect(|t| *t == Token::Equals, "`=`")?;
        match self.next()? {
            Token::Keyword(keyword) => self.part(keyword)?,
            Token::Open => loop {
                match self.next()? {
                    Token::Keyword(keyword) => self.part(keyword)?,
                    Token::Close => break,
                    other => return Err(self.unexpected(other, "a keyword or `)`")),
                }
            },
            other => return Err(self.unexpected(other, "a keyword or `(`")),
        }
        self.semicolon()?;
        let start = position(self.table.parts.len());
        self.table.parts.append(&mut self.parts);
        let parts = Span { start, end: position(self.table.parts.len()) };
        self.table.instances.push(Instance { id, parts });
        Ok(())
    }

    fn part(&mut self, keyword: &'a str) -> Result<(), CadError> {
        self.open()?;
        let values = self.list()?;
        self.parts.push(Part { keyword, values });
        Ok(())
    }

    /// Values up to the closing `)` of the list just opened. Nesting uses an explicit stack.
    fn list(&mut self) -> Result<Span, CadError> {
        self.lists.clear();
        self.lists.push((self.pending.len(), None));
        let mut keyword = None;
        let mut after_value = false;
        loop {
            let token = self.next()?;
            let value = match token {
                Token::Close if keyword.is_none() => {
                    let Some((start, kind)) = self.lists.pop() else { return Ok(Span::default()) };
                    let span = self.close(start);
                    if self.lists.is_empty() {
                        return Ok(span);
                    }
                    self.list_value(kind, span)
                }
                Token::Comma if after_value => {
                    after_value = false;
                    continue;
                }
                Token::Open if !after_value => {
                    self.open_list(keyword.take())?;
                    continue;
                }
                _ if after_value || keyword.is_some() => {
                    return Err(self.unexpected(token, "`,`, `(` or `)`"));
                }
                Token::Keyword(name) => {
                    keyword = Some(name);
                    continue;
                }
                _ => simple_value(token).ok_or_else(|| self.unexpected(token, "a value"))?,
            };
            self.pending.push(value);
            after_value = true;
        }
    }

    /// Opens a nested list: the attributes of `keyword` if given.
    fn open_list(&mut self, keyword: Option<&'a str>) -> Result<(), CadError> {
        if self.lists.len() >= LIST_DEPTH_MAX {
            let found = format!("lists nested deeper than {LIST_DEPTH_MAX}");
            return Err(self.fault(&found, "the nesting a schema gives (at most 4)"));
        }
        self.lists.push((self.pending.len(), keyword));
        Ok(())
    }

    /// Value of a closed list: the list itself, or the typed value of its keyword.
    fn list_value(&mut self, keyword: Option<&'a str>, values: Span) -> Value<'a> {
        let Some(keyword) = keyword else { return Value::List(values) };
        let part = position(self.table.parts.len());
        self.table.parts.push(Part { keyword, values });
        Value::Typed(part)
    }

    fn close(&mut self, start: usize) -> Span {
        let first = position(self.table.values.len());
        self.table.values.extend(self.pending.drain(start..));
        Span { start: first, end: position(self.table.values.len()) }
    }

    fn next(&mut self) -> Result<Token<'a>, CadError> {
        self.rest = blank(self.rest);
        match token(self.rest) {
            Ok((rest, token)) => {
                self.rest = rest;
                Ok(token)
            }
            Err(_) => {
                let shown: Vec<u8> = self.rest.iter().copied().take(24).collect();
                let shown = String::from_utf8_lossy(&shown);
                let shown = shown.lines().next().unwrap_or("");
                let found = if self.rest.is_empty() {
                    "the end of the file inside an entity".to_string()
                } else {
                    format!("`{shown}`")
                };
                Err(self.fault(&found, "a keyword, a finite number, 'text', .ENUM., #id, $ or *"))
            }
        }
    }

    fn open(&mut self) -> Result<(), CadError> {
        self.expect(|t| *t == Token::Open, "`(`")
    }

    fn semicolon(&mut self) -> Result<(), CadError> {
        self.expect(|t| *t == Token::Semicolon, "`;`")
    }

    fn expect(&mut self, is: impl Fn(&Token) -> bool, allowed: &str) -> Result<(), CadError> {
        let token = self.next()?;
        if is(&token) { Ok(()) } else { Err(self.unexpected(token, allowed)) }
    }

    fn unexpected(&self, token: Token, allowed: &str) -> CadError {
        self.fault(&format!("{token:?}").chars().take(80).collect::<String>(), allowed)
    }

    fn fault(&self, found: &str, allowed: &str) -> CadError {
        let at = self.bytes.len() - self.rest.len();
        let before = self.bytes.get(..at).unwrap_or(&[]);
        let line = 1 + before.iter().filter(|&&b| b == b'\n').count();
        let last = self.table.instances.last().map(|i| format!(", after #{}", i.id));
        CadError::Invalid {
            file: self.file.into(),
            place: format!("line {line}{}", last.unwrap_or_default()),
            found: found.into(),
            allowed: allowed.into(),
            remedy: "the text is damaged or cut off: export the model again".into(),
        }
    }
}

/// Value of a single token; `None` for keywords and punctuation.
fn simple_value(token: Token<'_>) -> Option<Value<'_>> {
    Some(match token {
        Token::Id(id) => Value::Reference(id),
        Token::Integer(n) => Value::Integer(n),
        Token::Real(x) => Value::Real(x),
        Token::Text(text) => Value::Text(text),
        Token::Enumeration(name) => Value::Enumeration(name),
        Token::Opaque => Value::Opaque,
        Token::Missing => Value::Missing,
        Token::Derived => Value::Derived,
        _ => return None,
    })
}

/// Array index as 32 bits: a table of more than 4e9 values does not fit in memory.
fn position(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}
