//! The tokens of a Part 21 exchange structure (ISO 10303-21:2016, clause 6 and table 2).
//! The lexer never allocates: a token holds its place in the source.

use super::StepError;

/// A stretch of the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) start: u32,
    pub(super) end: u32,
}

/// One token.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Token {
    /// A keyword, of the standard or user-defined (`!NAME`).
    Keyword(Span),
    /// `#123`.
    Instance(u64),
    Integer(i64),
    Real(f64),
    /// A string, without its outer quotes, still encoded.
    Text(Span),
    /// An enumeration, without its dots.
    Enumeration(Span),
    /// A binary, without its quotes.
    Binary(Span),
    Open,
    Close,
    Comma,
    Semicolon,
    Equals,
    /// `$`.
    Omitted,
    /// `*`.
    Derived,
    End,
}

/// Cuts the source into tokens.
#[derive(Debug)]
pub(super) struct Lexer<'s> {
    source: &'s [u8],
    at: usize,
    /// Where the last token began.
    pub(super) token_start: usize,
}

/// Line of a byte offset, from 1.
pub(super) fn line_of(source: &[u8], offset: usize) -> usize {
    let before = source.get(..offset).unwrap_or(source);
    1 + before.split(|&b| b == b'\n').count().saturating_sub(1)
}

impl<'s> Lexer<'s> {
    /// `source` must be shorter than 4 GiB: the caller has checked.
    pub(super) fn new(source: &'s [u8]) -> Self {
        Self {
            source,
            at: 0,
            token_start: 0,
        }
    }

    fn peek(&self) -> Option<u8> {
        self.source.get(self.at).copied()
    }

    fn span(&self, start: usize, end: usize) -> Span {
        debug_assert!(end <= self.source.len());
        Span {
            start: start as u32,
            end: end as u32,
        }
    }

    fn truncated(&self, inside: &'static str) -> StepError {
        StepError::Truncated {
            line: line_of(self.source, self.source.len()),
            inside,
        }
    }

    /// The error of finding the last token where `expected` should be.
    pub(super) fn unexpected(&self, expected: &'static str) -> StepError {
        if self.token_start >= self.source.len() {
            return self.truncated(expected);
        }
        let rest = self.source.get(self.token_start..).unwrap_or_default();
        let shown: Vec<u8> = rest
            .iter()
            .copied()
            .take_while(|b| !matches!(b, b'\n' | b'\r'))
            .take(24)
            .collect();
        StepError::Syntax {
            line: line_of(self.source, self.token_start),
            expected,
            found: format!("`{}`", String::from_utf8_lossy(&shown).escape_debug()),
        }
    }

    /// Skips blanks, comments and print control directives.
    fn skip_blank(&mut self) -> Result<(), StepError> {
        while let Some(b) = self.peek() {
            match b {
                b'/' if self.source.get(self.at + 1) == Some(&b'*') => {
                    let body = self.source.get(self.at + 2..).unwrap_or_default();
                    match body.windows(2).position(|w| w == b"*/") {
                        Some(len) => self.at += len + 4,
                        None => return Err(self.truncated("a comment")),
                    }
                }
                b'\\'
                    if matches!(
                        self.source.get(self.at..self.at + 3),
                        Some(b"\\N\\" | b"\\F\\")
                    ) =>
                {
                    self.at += 3;
                }
                // control characters, a byte order mark's bytes and blanks separate tokens
                0..=b' ' | 0x7f | 0xa0 | 0xbb | 0xbf | 0xef => self.at += 1,
                _ => break,
            }
        }
        Ok(())
    }

    fn take_while(&mut self, keep: impl Fn(u8) -> bool) {
        while self.peek().is_some_and(&keep) {
            self.at += 1;
        }
    }

    /// The next token; [`Token::End`] for ever after the last.
    pub(super) fn next(&mut self) -> Result<Token, StepError> {
        self.skip_blank()?;
        self.token_start = self.at;
        let Some(b) = self.peek() else {
            return Ok(Token::End);
        };
        let simple = match b {
            b'(' => Some(Token::Open),
            b')' => Some(Token::Close),
            b',' => Some(Token::Comma),
            b';' => Some(Token::Semicolon),
            b'=' => Some(Token::Equals),
            b'$' => Some(Token::Omitted),
            b'*' => Some(Token::Derived),
            _ => None,
        };
        if let Some(token) = simple {
            self.at += 1;
            return Ok(token);
        }
        match b {
            b'#' => self.instance(),
            b'\'' => self.text(),
            b'"' => self.binary(),
            b'+' | b'-' | b'0'..=b'9' => self.number(),
            b'.' if self.source.get(self.at + 1).is_some_and(u8::is_ascii_digit) => self.number(),
            b'.' => self.enumeration(),
            b'A'..=b'Z' | b'a'..=b'z' | b'_' | b'!' => {
                let start = self.at;
                self.at += 1;
                self.take_while(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-'));
                Ok(Token::Keyword(self.span(start, self.at)))
            }
            _ => Err(self.unexpected("a STEP token")),
        }
    }

    fn instance(&mut self) -> Result<Token, StepError> {
        self.at += 1;
        let start = self.at;
        self.take_while(|b| b.is_ascii_digit());
        let digits = self.source.get(start..self.at).unwrap_or_default();
        if digits.is_empty() {
            return Err(self.unexpected("an instance number after `#`"));
        }
        digits
            .iter()
            .try_fold(0u64, |id, &d| {
                id.checked_mul(10)?.checked_add(u64::from(d - b'0'))
            })
            .map(Token::Instance)
            .ok_or_else(|| self.unexpected("an instance number below 2^64"))
    }

    fn text(&mut self) -> Result<Token, StepError> {
        self.at += 1;
        let start = self.at;
        loop {
            self.take_while(|b| b != b'\'');
            if self.peek().is_none() {
                return Err(self.truncated("a string"));
            }
            self.at += 1;
            // a doubled apostrophe stands for one and does not end the string
            if self.peek() == Some(b'\'') {
                self.at += 1;
            } else {
                return Ok(Token::Text(self.span(start, self.at - 1)));
            }
        }
    }

    fn binary(&mut self) -> Result<Token, StepError> {
        self.at += 1;
        let start = self.at;
        self.take_while(|b| b.is_ascii_hexdigit());
        self.close(b'"', ["a binary", "a binary of hexadecimal digits"])?;
        Ok(Token::Binary(self.span(start, self.at - 1)))
    }

    /// Takes the mark at which a token ends; otherwise says what the token is, and what it is as a whole.
    fn close(&mut self, mark: u8, [what, whole]: [&'static str; 2]) -> Result<(), StepError> {
        match self.peek() {
            Some(b) if b == mark => {
                self.at += 1;
                Ok(())
            }
            Some(_) => Err(self.unexpected(whole)),
            None => Err(self.truncated(what)),
        }
    }

    fn enumeration(&mut self) -> Result<Token, StepError> {
        self.at += 1;
        let start = self.at;
        self.take_while(|b| b.is_ascii_alphanumeric() || b == b'_');
        self.close(b'.', ["an enumeration", "an enumeration between dots"])?;
        Ok(Token::Enumeration(self.span(start, self.at - 1)))
    }

    fn number(&mut self) -> Result<Token, StepError> {
        let start = self.at;
        self.at += 1;
        let mut real = self.source.get(start) == Some(&b'.');
        while let Some(b) = self.peek() {
            match b {
                b'0'..=b'9' => {}
                b'.' | b'e' | b'E' => real = true,
                b'+' | b'-' if matches!(self.source.get(self.at - 1), Some(b'e' | b'E')) => {}
                _ => break,
            }
            self.at += 1;
        }
        let text = self
            .source
            .get(start..self.at)
            .and_then(|t| std::str::from_utf8(t).ok())
            .unwrap_or_default();
        let parsed = if real {
            text.parse()
                .ok()
                .filter(|v: &f64| v.is_finite())
                .map(Token::Real)
        } else {
            text.parse().ok().map(Token::Integer)
        };
        parsed.ok_or_else(|| self.unexpected("a finite number"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<Token> {
        let mut lexer = Lexer::new(text.as_bytes());
        let mut tokens = Vec::new();
        loop {
            match lexer.next().unwrap() {
                Token::End => return tokens,
                token => tokens.push(token),
            }
        }
    }

    #[test]
    fn cuts_every_kind_of_token() {
        let text = "#12=A_B('it''s',.T.,\"0FF\",-3,1.E-2,$,*);/* #9 */";
        let span = |start, end| Span { start, end };
        assert_eq!(
            all(text),
            [
                Token::Instance(12),
                Token::Equals,
                Token::Keyword(span(4, 7)),
                Token::Open,
                Token::Text(span(9, 14)),
                Token::Comma,
                Token::Enumeration(span(17, 18)),
                Token::Comma,
                Token::Binary(span(21, 24)),
                Token::Comma,
                Token::Integer(-3),
                Token::Comma,
                Token::Real(0.01),
                Token::Comma,
                Token::Omitted,
                Token::Comma,
                Token::Derived,
                Token::Close,
                Token::Semicolon,
            ]
        );
    }

    #[test]
    fn open_ends_are_errors_with_a_line() {
        for text in ["\n'abc", "\n/* abc", "\n\"0", "\n.T"] {
            let mut lexer = Lexer::new(text.as_bytes());
            assert!(
                matches!(lexer.next(), Err(StepError::Truncated { line: 2, .. })),
                "{text:?}"
            );
        }
        let mut lexer = Lexer::new(b"\n\n@");
        assert!(matches!(
            lexer.next(),
            Err(StepError::Syntax { line: 3, .. })
        ));
        let mut lexer = Lexer::new(b"1.E999");
        assert!(matches!(lexer.next(), Err(StepError::Syntax { .. })));
    }
}
