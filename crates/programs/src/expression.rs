//! Values and conditions as programs write them: numbers, registers, variables, arguments of calls, `+ - * / DIV MOD`, comparisons, `AND OR NOT !`.
//! What only the controller knows (inputs that nobody tells, positions, texts) makes the whole unknown, unless the rest decides it.

use std::collections::{BTreeMap, BTreeSet};

/// Expressions nested deeper than this are not read.
const DEEPEST: usize = 32;

/// X, Y, Z, mm, and W, P, R, degrees, as far as they are known.
pub(crate) type Elements = [Option<f64>; 6];

/// What a program can read while it runs.
#[derive(Default)]
pub(crate) struct Memory {
    /// Registers whose content is known.
    pub(crate) registers: BTreeMap<u32, f64>,
    /// Inputs, outputs and flags whose state is known, by name in capitals and number.
    pub(crate) signals: BTreeMap<(String, u32), bool>,
    /// Position registers, as far as they are known.
    pub(crate) positions: BTreeMap<u32, Elements>,
    /// Arguments of the calls that run, innermost last.
    pub(crate) arguments: Vec<Vec<Option<f64>>>,
    /// Variables whose value is known.
    pub(crate) names: Names,
}

/// Variables by their names, and what a language makes of them.
#[derive(Default)]
pub(crate) struct Names {
    /// By their names as [`Names::key`] spells them.
    pub(crate) values: BTreeMap<String, f64>,
    /// Those that hold truth values alone: 1 where it is true.
    pub(crate) truths: BTreeSet<String>,
    pub(crate) spelling: Spelling,
    pub(crate) quotient: Quotient,
}

/// Whether capitals make another name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Spelling {
    #[default]
    AnyCase,
    Exact,
}

/// What two whole numbers divide to that leave a rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Quotient {
    #[default]
    Fraction,
    /// That hangs on their types.
    Unknown,
}

impl Names {
    /// What a variable holds.
    fn held(&self, name: &str) -> Value {
        match self.value(name) {
            Some(value) if self.truths.contains(&self.key(name)) => Value::Truth(value != 0.0),
            Some(value) => Value::Number(value),
            None => Value::Unknown,
        }
    }

    pub(crate) fn key(&self, name: &str) -> String {
        match self.spelling {
            Spelling::AnyCase => name.to_ascii_lowercase(),
            Spelling::Exact => name.to_owned(),
        }
    }

    pub(crate) fn value(&self, name: &str) -> Option<f64> {
        self.values.get(&self.key(name)).copied()
    }
}

/// The value of an expression, where it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Value {
    Number(f64),
    Truth(bool),
    Unknown,
}

impl Memory {
    /// The number that `text` stands for.
    pub(crate) fn number(&self, text: &str) -> Option<f64> {
        match self.value(text) {
            Some(Value::Number(v)) if v.is_finite() => Some(v),
            _ => None,
        }
    }

    /// The whole number from 0 that `text` stands for.
    pub(crate) fn index(&self, text: &str) -> Option<u32> {
        let number = self.number(text)?;
        let whole = number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number);
        whole.then_some(number as u32)
    }

    /// Whether the condition `text` holds.
    pub(crate) fn condition(&self, text: &str) -> Option<bool> {
        match self.value(text) {
            Some(Value::Truth(holds)) => Some(holds),
            _ => None,
        }
    }

    /// Name and number of what `text` refers to: `R[3]`, `DO[3:name]`, `R[R[3]]`.
    pub(crate) fn reference(&self, text: &str) -> Option<(String, u32)> {
        let mut reader = Reader {
            memory: self,
            rest: text,
            depth: 0,
        };
        let name = reader.name()?;
        let inner = reader.bracket()?;
        let index = self.index(without_comment(inner))?;
        let whole = reader.rest.trim().is_empty();
        whole.then(|| (name.to_ascii_uppercase(), index))
    }

    fn value(&self, text: &str) -> Option<Value> {
        let mut reader = Reader {
            memory: self,
            rest: text,
            depth: 0,
        };
        let value = reader.either()?;
        reader.rest.trim().is_empty().then_some(value)
    }
}

/// What stands in a bracket before the comment.
fn without_comment(inner: &str) -> &str {
    inner.split(':').next().unwrap_or(inner)
}

/// Reads an expression from the front; `None` where it is none.
struct Reader<'a> {
    memory: &'a Memory,
    rest: &'a str,
    depth: usize,
}

impl<'a> Reader<'a> {
    /// Takes a symbol.
    fn take(&mut self, symbol: &str) -> bool {
        let rest = self.rest.trim_start();
        let Some(after) = rest.strip_prefix(symbol) else {
            return false;
        };
        self.rest = after;
        true
    }

    /// Takes a word.
    fn word(&mut self, word: &str) -> bool {
        let before = self.rest;
        if self
            .name()
            .is_some_and(|name| name.eq_ignore_ascii_case(word))
        {
            return true;
        }
        self.rest = before;
        false
    }

    /// Takes any name.
    fn name(&mut self) -> Option<&'a str> {
        let rest = self.rest.trim_start();
        let part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '$' | '.');
        let end = rest.find(|c| !part(c)).unwrap_or(rest.len());
        let starts = rest.starts_with(|c: char| c.is_ascii_alphabetic() || c == '$');
        (end > 0 && starts).then(|| {
            self.rest = &rest[end..];
            &rest[..end]
        })
    }

    /// Takes a bracket and gives what stands in it.
    fn bracket(&mut self) -> Option<&'a str> {
        let (inner, after) = crate::scan::bracket(self.rest)?;
        self.rest = after;
        Some(inner)
    }

    fn either(&mut self) -> Option<Value> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return None;
        }
        let value = self.joined(("OR", Value::Truth(true)), |s| {
            s.joined(("AND", Value::Truth(false)), Self::compared)
        })?;
        self.depth -= 1;
        Some(value)
    }

    /// Values joined by a word: the one that decides alone, else the same of both, else unknown.
    fn joined(
        &mut self,
        (word, decides): (&str, Value),
        next: impl Fn(&mut Self) -> Option<Value>,
    ) -> Option<Value> {
        let mut value = next(self)?;
        while self.word(word) {
            value = match (value, next(self)?) {
                (a, b) if a == decides || b == decides => decides,
                (Value::Truth(a), Value::Truth(_)) => Value::Truth(a),
                _ => Value::Unknown,
            };
        }
        Some(value)
    }

    /// The contrary of what comes next.
    fn denied(&mut self, next: fn(&mut Self) -> Option<Value>) -> Option<Value> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return None;
        }
        let value = next(self)?;
        self.depth -= 1;
        Some(match value {
            Value::Truth(holds) => Value::Truth(!holds),
            _ => Value::Unknown,
        })
    }

    fn compared(&mut self) -> Option<Value> {
        // it binds less than what compares
        if self.word("NOT") {
            return self.denied(Self::compared);
        }
        let left = self.sum()?;
        // longer symbols first
        for symbol in ["<>", "!=", "<=", ">=", "==", "=", "<", ">"] {
            if self.take(symbol) {
                let (a, b) = match (left, self.sum()?) {
                    (Value::Number(a), Value::Number(b)) => (a, b),
                    (Value::Truth(a), Value::Truth(b)) => (f64::from(a), f64::from(b)),
                    _ => return Some(Value::Unknown),
                };
                return Some(Value::Truth(match symbol {
                    "<>" | "!=" => a != b,
                    "<=" => a <= b,
                    ">=" => a >= b,
                    "=" | "==" => a == b,
                    "<" => a < b,
                    _ => a > b,
                }));
            }
        }
        Some(left)
    }

    fn sum(&mut self) -> Option<Value> {
        let mut value = self.product()?;
        loop {
            let sign = if self.take("+") {
                1.0
            } else if self.take("-") {
                -1.0
            } else {
                return Some(value);
            };
            value = both(value, self.product()?, |a, b| a + sign * b);
        }
    }

    fn product(&mut self) -> Option<Value> {
        let mut value = self.factor()?;
        loop {
            let operation: fn(f64, f64) -> f64 = if self.take("*") {
                |a, b| a * b
            } else if self.take("/") {
                match self.memory.names.quotient {
                    Quotient::Fraction => |a, b| a / b,
                    // no number: such a value is none that is known
                    Quotient::Unknown => |a, b| match (a.fract(), b.fract(), (a / b).fract()) {
                        (0.0, 0.0, rest) if rest != 0.0 => f64::NAN,
                        _ => a / b,
                    },
                }
            } else if self.word("DIV") {
                |a, b| (a / b).trunc()
            } else if self.word("MOD") || self.take("%") {
                |a, b| a % b
            } else {
                return Some(value);
            };
            value = both(value, self.factor()?, operation);
        }
    }

    fn factor(&mut self) -> Option<Value> {
        if self.depth > DEEPEST {
            return None;
        }
        if self.take("(") {
            let value = self.either()?;
            return self.take(")").then_some(value);
        }
        if self.take("-") {
            self.depth += 1;
            let value = both(Value::Number(0.0), self.factor()?, |a, b| a - b);
            self.depth -= 1;
            return Some(value);
        }
        if self.take("!") {
            return self.denied(Self::factor);
        }
        let rest = self.rest.trim_start();
        let end = rest.find(|c: char| !(c.is_ascii_digit() || c == '.'));
        let (digits, after) = rest.split_at(end.unwrap_or(rest.len()));
        if let Ok(number) = digits.parse() {
            self.rest = after;
            return Some(Value::Number(number));
        }
        let name = self.name()?;
        let known = |v: Option<f64>| v.map_or(Value::Unknown, Value::Number);
        let Some(inner) = self.bracket().map(without_comment) else {
            return Some(match name.to_ascii_uppercase().as_str() {
                "ON" | "TRUE" => Value::Truth(true),
                "OFF" | "FALSE" => Value::Truth(false),
                _ => self.memory.names.held(name),
            });
        };
        if let Some((register, element)) = inner.split_once(',') {
            let [register, element] =
                [register, element].map(|t| self.memory.nested(t, self.depth));
            let all = register.and_then(|r| self.memory.positions.get(&r));
            let at = element.and_then(|e| (e as usize).checked_sub(1));
            let value = all.zip(at).and_then(|(all, at)| *all.get(at)?);
            return Some(known(value.filter(|_| name.eq_ignore_ascii_case("PR"))));
        }
        let index = self.memory.nested(inner, self.depth);
        let Some(index) = index else {
            return Some(Value::Unknown);
        };
        let element = self.memory.names.value(&format!("{name}[{index}]"));
        if element.is_some() {
            return Some(known(element));
        }
        let name = name.to_ascii_uppercase();
        Some(match name.as_str() {
            "R" => known(self.memory.registers.get(&index).copied()),
            "AR" => {
                let arguments = self.memory.arguments.last();
                let at = (index as usize).checked_sub(1);
                known(arguments.zip(at).and_then(|(a, at)| *a.get(at)?))
            }
            _ => {
                let signal = self.memory.signals.get(&(name, index));
                signal.map_or(Value::Unknown, |on| Value::Truth(*on))
            }
        })
    }
}

impl Memory {
    /// The number in a bracket, within an expression of some depth.
    fn nested(&self, inner: &str, depth: usize) -> Option<u32> {
        let mut reader = Reader {
            memory: self,
            rest: inner,
            depth: depth + 1,
        };
        let Value::Number(value) = reader.sum()? else {
            return None;
        };
        let whole = reader.rest.trim().is_empty() && value.fract() == 0.0;
        (whole && (0.0..=f64::from(u32::MAX)).contains(&value)).then_some(value as u32)
    }
}

/// An operation on two numbers.
fn both(a: Value, b: Value, operation: impl Fn(f64, f64) -> f64) -> Value {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => match operation(a, b) {
            value if value.is_finite() => Value::Number(value),
            _ => Value::Unknown,
        },
        _ => Value::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_have_the_values_that_controllers_give_them() {
        let memory = Memory {
            registers: BTreeMap::from([(1, 2.0), (2, 7.5), (3, -4.0)]),
            signals: BTreeMap::from([(("DI".to_owned(), 7), true)]),
            positions: BTreeMap::from([(4, [Some(1.0), None, Some(7.0), None, None, None])]),
            arguments: vec![vec![None], vec![Some(3.0), None]],
            ..Memory::default()
        };
        for (text, value) in [
            ("1.5", Some(1.5)),
            ("R[1]+R[2]*2", Some(17.0)),
            ("(R[1]+R[2:speed])*2", Some(19.0)),
            ("R[R[1]]", Some(7.5)),
            ("R[2] DIV 2", Some(3.0)),
            ("7 MOD 4", Some(3.0)),
            ("(-4)-R[3]", Some(0.0)),
            ("AR[1]-1", Some(2.0)),
            ("AR[2]", None),
            ("PR[4,3:z]+1", Some(8.0)),
            ("PR[4,2]", None),
            ("PR[4,7]", None),
            ("R[4,3]", None),
            ("R[9]", None),
            ("DI[1]", None),
            ("1/0", None),
            ("R[1] R[2]", None),
            ("R[1", None),
            ("", None),
        ] {
            assert_eq!(memory.number(text), value, "{text}");
        }
        for (text, holds) in [
            ("R[1]=2", Some(true)),
            ("(R[1]<>2)", Some(false)),
            ("R[2]>=7.5 AND R[1]<3", Some(true)),
            ("R[9]=1 AND R[1]=3", Some(false)),
            ("R[9]=1 AND R[1]=2", None),
            ("DI[1]=ON OR R[1]=2", Some(true)),
            ("!(R[1]=2)", Some(false)),
            ("DI[1:start]=ON", None),
            ("DI[7:start]=ON", Some(true)),
            ("DI[7]", Some(true)),
            ("!DI[7]", Some(false)),
            ("DI[7]=OFF AND DI[1]", Some(false)),
            ("R[1]", None),
        ] {
            assert_eq!(memory.condition(text), holds, "{text}");
        }
        let register = Some(("R".to_owned(), 2));
        assert_eq!(memory.reference("R[R[1]:x]"), register);
        assert_eq!(memory.reference("PR[1,2]"), None);
        // bounded
        assert_eq!(memory.number(&"(".repeat(100_000)), None);
        assert_eq!(memory.number(&"R[".repeat(100_000)), None);
        assert_eq!(memory.number(&"-".repeat(100_000)), None);
    }
}
