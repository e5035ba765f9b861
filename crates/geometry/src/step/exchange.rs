//! The exchange structure of ISO 10303-21: header and data sections as flat tables of records.
//!
//! The parser keeps its own stack, so that nesting of any depth is read without recursion, and
//! holds all attribute values in one arena.

use std::collections::HashMap;

use super::StepError;
use super::lexer::{Lexer, Span, Token, line_of};

/// An attribute value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value {
    Omitted,
    Derived,
    Integer(i64),
    Real(f64),
    Text(Span),
    Enumeration(Span),
    Binary,
    Reference(u64),
    List(Run),
    /// A typed parameter, such as `LENGTH_MEASURE(25.4)`: its values.
    Typed(Run),
}

/// A run of values in the arena.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Run {
    start: u32,
    len: u32,
}

/// `KEYWORD(attributes)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Record {
    pub(super) keyword: Span,
    pub(super) attributes: Run,
}

/// `#id = record;` or `#id = (record record …);`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Instance {
    pub(super) id: u64,
    /// Byte offset of the `#`.
    pub(super) offset: u32,
    records: Run,
}

/// A parsed file.
#[derive(Debug)]
pub(super) struct Exchange<'s> {
    source: &'s [u8],
    pub(super) instances: Vec<Instance>,
    records: Vec<Record>,
    values: Vec<Value>,
    index: HashMap<u64, u32>,
}

impl<'s> Exchange<'s> {
    /// Parses a whole file.
    pub(super) fn parse(source: &'s [u8]) -> Result<Self, StepError> {
        if u32::try_from(source.len()).is_err() {
            return Err(StepError::TooLarge {
                bytes: source.len(),
            });
        }
        let mut parser = Parser {
            lexer: Lexer::new(source),
            token: Token::End,
            out: Self {
                source,
                instances: Vec::new(),
                records: Vec::new(),
                values: Vec::new(),
                index: HashMap::new(),
            },
            scratch: Vec::new(),
            frames: Vec::new(),
        };
        parser.file()?;
        let mut out = parser.out;
        out.index.reserve(out.instances.len());
        for (position, instance) in out.instances.iter().enumerate() {
            if let Some(first) = out.index.insert(instance.id, position as u32) {
                return Err(StepError::Duplicate {
                    id: instance.id,
                    first: line_of(source, out.instances[first as usize].offset as usize),
                    second: line_of(source, instance.offset as usize),
                });
            }
        }
        Ok(out)
    }

    /// Position of instance `#id`.
    pub(super) fn find(&self, id: u64) -> Option<usize> {
        self.index.get(&id).map(|&i| i as usize)
    }

    /// The records of an instance.
    pub(super) fn records(&self, instance: &Instance) -> &[Record] {
        let Run { start, len } = instance.records;
        self.records
            .get(start as usize..(start + len) as usize)
            .unwrap_or_default()
    }

    /// The values of a run.
    pub(super) fn values(&self, run: Run) -> &[Value] {
        self.values
            .get(run.start as usize..(run.start + run.len) as usize)
            .unwrap_or_default()
    }

    /// The raw bytes of a span.
    pub(super) fn bytes(&self, span: Span) -> &'s [u8] {
        self.source
            .get(span.start as usize..span.end as usize)
            .unwrap_or_default()
    }

    /// A keyword or enumeration: ASCII by its grammar.
    pub(super) fn word(&self, span: Span) -> &'s str {
        std::str::from_utf8(self.bytes(span)).unwrap_or_default()
    }

    /// Line of a byte offset, from 1.
    pub(super) fn line(&self, offset: u32) -> usize {
        line_of(self.source, offset as usize)
    }
}

/// An open parenthesis.
#[derive(Debug, Clone, Copy)]
struct Frame {
    typed: bool,
    /// Where its values begin in the scratch stack.
    start: usize,
}

struct Parser<'s> {
    lexer: Lexer<'s>,
    token: Token,
    out: Exchange<'s>,
    scratch: Vec<Value>,
    frames: Vec<Frame>,
}

impl Parser<'_> {
    fn advance(&mut self) -> Result<(), StepError> {
        self.token = self.lexer.next()?;
        Ok(())
    }

    fn expect(&mut self, token: Token, what: &'static str) -> Result<(), StepError> {
        if self.token == token {
            self.advance()
        } else {
            Err(self.lexer.unexpected(what))
        }
    }

    fn keyword(&self) -> Option<&str> {
        match self.token {
            Token::Keyword(span) => Some(self.out.word(span)),
            _ => None,
        }
    }

    fn file(&mut self) -> Result<(), StepError> {
        // anything may stand here: it is not yet known to be STEP
        let first = self.lexer.next();
        self.token = first.unwrap_or(Token::End);
        if self.keyword() != Some("ISO-10303-21") {
            let shown: Vec<u8> = self.out.source.iter().copied().take(24).collect();
            let found = if shown.is_empty() {
                "an empty file".to_owned()
            } else {
                format!("`{}`", String::from_utf8_lossy(&shown).escape_debug())
            };
            return Err(StepError::NotStep { found });
        }
        self.advance()?;
        self.expect(Token::Semicolon, "`;` after ISO-10303-21")?;
        let mut sections = 0;
        loop {
            match self.keyword() {
                Some("HEADER") => self.section(Section::Header)?,
                Some("DATA") => {
                    sections += 1;
                    self.section(Section::Data)?;
                }
                Some("ANCHOR" | "REFERENCE" | "SIGNATURE") => self.section(Section::Skipped)?,
                Some("END-ISO-10303-21") => break,
                _ => return Err(self.lexer.unexpected("a section or END-ISO-10303-21")),
            }
        }
        if sections == 0 {
            return Err(self.lexer.unexpected("a DATA section"));
        }
        Ok(())
    }

    fn section(&mut self, section: Section) -> Result<(), StepError> {
        self.advance()?;
        if section == Section::Skipped {
            while self.keyword() != Some("ENDSEC") {
                if self.token == Token::End {
                    return Err(self.lexer.unexpected("ENDSEC"));
                }
                self.advance()?;
            }
        } else {
            if self.token == Token::Open {
                // DATA('name',('schema')): which of several sections this is
                self.attributes()?;
            }
            self.expect(Token::Semicolon, "`;` after the section's name")?;
        }
        loop {
            match self.token {
                Token::Keyword(_) if self.keyword() == Some("ENDSEC") => break,
                Token::Keyword(_) if section == Section::Header => {
                    self.record()?;
                    self.expect(Token::Semicolon, "`;` after a header record")?;
                }
                Token::Instance(id) if section == Section::Data => self.instance(id)?,
                _ => return Err(self.lexer.unexpected("an instance or ENDSEC")),
            }
        }
        self.advance()?;
        self.expect(Token::Semicolon, "`;` after ENDSEC")
    }

    fn instance(&mut self, id: u64) -> Result<(), StepError> {
        let offset = self.lexer.token_start as u32;
        self.advance()?;
        self.expect(Token::Equals, "`=` after the instance number")?;
        let start = self.out.records.len();
        if self.token == Token::Open {
            self.advance()?;
            self.record()?;
            while self.token != Token::Close {
                self.record()?;
            }
            self.advance()?;
        } else {
            self.record()?;
        }
        self.expect(Token::Semicolon, "`;` after an instance")?;
        let len = self.out.records.len() - start;
        self.out.instances.push(Instance {
            id,
            offset,
            records: Run {
                start: start as u32,
                len: len as u32,
            },
        });
        Ok(())
    }

    fn record(&mut self) -> Result<(), StepError> {
        let Token::Keyword(keyword) = self.token else {
            return Err(self.lexer.unexpected("an entity type"));
        };
        self.advance()?;
        if self.token != Token::Open {
            return Err(self.lexer.unexpected("`(`"));
        }
        let attributes = self.attributes()?;
        self.out.records.push(Record {
            keyword,
            attributes,
        });
        Ok(())
    }

    /// Moves the values above `start` from the scratch stack to the arena.
    fn close(&mut self, start: usize) -> Run {
        let run = Run {
            start: self.out.values.len() as u32,
            len: (self.scratch.len() - start) as u32,
        };
        self.out.values.extend(self.scratch.drain(start..));
        run
    }

    /// Parses `( values )` from the opening parenthesis, without recursion.
    fn attributes(&mut self) -> Result<Run, StepError> {
        self.scratch.clear();
        self.frames.clear();
        self.frames.push(Frame {
            typed: false,
            start: 0,
        });
        self.advance()?;
        // whether a value must come next (after a comma), may come (after `(`) or must not
        let mut wanted = Wanted::ValueOrClose;
        loop {
            if self.token == Token::Close && wanted != Wanted::Value {
                let Some(frame) = self.frames.pop() else {
                    return Err(self.lexer.unexpected("`;`"));
                };
                let run = self.close(frame.start);
                self.advance()?;
                if self.frames.is_empty() {
                    return Ok(run);
                }
                self.scratch.push(if frame.typed {
                    Value::Typed(run)
                } else {
                    Value::List(run)
                });
                wanted = Wanted::CommaOrClose;
                continue;
            }
            if wanted == Wanted::CommaOrClose {
                self.expect(Token::Comma, "`,` or `)`")?;
                wanted = Wanted::Value;
                continue;
            }
            let value = match self.token {
                Token::Omitted => Value::Omitted,
                Token::Derived => Value::Derived,
                Token::Integer(v) => Value::Integer(v),
                Token::Real(v) => Value::Real(v),
                Token::Text(span) => Value::Text(span),
                Token::Enumeration(span) => Value::Enumeration(span),
                Token::Binary(_) => Value::Binary,
                Token::Instance(id) => Value::Reference(id),
                Token::Open | Token::Keyword(_) => {
                    let typed = self.token != Token::Open;
                    if typed {
                        self.advance()?;
                        if self.token != Token::Open {
                            return Err(self.lexer.unexpected("`(` after a type"));
                        }
                    }
                    self.frames.push(Frame {
                        typed,
                        start: self.scratch.len(),
                    });
                    self.advance()?;
                    wanted = Wanted::ValueOrClose;
                    continue;
                }
                _ => return Err(self.lexer.unexpected("a value")),
            };
            self.scratch.push(value);
            self.advance()?;
            wanted = Wanted::CommaOrClose;
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Section {
    Header,
    Data,
    Skipped,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wanted {
    Value,
    ValueOrClose,
    CommaOrClose,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrap(data: &str) -> String {
        format!(
            "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('X'));\nENDSEC;\nDATA;\n{data}\nENDSEC;\nEND-ISO-10303-21;\n"
        )
    }

    #[test]
    fn simple_and_complex_instances() {
        let text = wrap("#1=A('x',(1,2.),B(3.));\n#7=(C(#1)D());");
        let file = Exchange::parse(text.as_bytes()).unwrap();
        assert_eq!(file.instances.len(), 2);
        let a = file.records(&file.instances[0])[0];
        assert_eq!(file.word(a.keyword), "A");
        let [Value::Text(_), Value::List(list), Value::Typed(typed)] = file.values(a.attributes)
        else {
            panic!("wrong shape of attributes");
        };
        assert_eq!(file.values(*list), [Value::Integer(1), Value::Real(2.0)]);
        assert_eq!(file.values(*typed), [Value::Real(3.0)]);
        let complex = file.records(&file.instances[file.find(7).unwrap()]);
        assert_eq!(complex.len(), 2);
        assert_eq!(file.values(complex[0].attributes), [Value::Reference(1)]);
        assert_eq!(file.line(file.instances[1].offset), 7);
    }

    #[test]
    fn nesting_of_any_depth_is_read() {
        let depth = 1_000_000;
        let text = wrap(&format!(
            "#1=A({}{});",
            "(".repeat(depth),
            ")".repeat(depth)
        ));
        assert_eq!(Exchange::parse(text.as_bytes()).unwrap().instances.len(), 1);
        let open = wrap(&format!("#1=A({}", "(".repeat(depth)));
        assert!(Exchange::parse(open.as_bytes()).is_err());
    }

    #[test]
    fn damage_is_named_with_its_line() {
        let cases = [
            ("#1=A(1,);", 6),
            ("#1=A(1 2);", 6),
            ("#1=A\n;", 7),
            ("#1 A();", 6),
            ("\n#1=();", 7),
        ];
        for (data, line) in cases {
            match Exchange::parse(wrap(data).as_bytes()) {
                Err(StepError::Syntax { line: found, .. }) => assert_eq!(found, line, "{data}"),
                other => panic!("{data}: {other:?}"),
            }
        }
        assert!(matches!(
            Exchange::parse(wrap("#1=A();\n#1=A();").as_bytes()),
            Err(StepError::Duplicate {
                id: 1,
                first: 6,
                second: 7
            })
        ));
        assert!(matches!(
            Exchange::parse(b"solid x"),
            Err(StepError::NotStep { .. })
        ));
        assert!(matches!(
            Exchange::parse(b""),
            Err(StepError::NotStep { .. })
        ));
    }
}
