//! A seeded mutator: damages valid files by their tokens where they are text, by their fields where they are not.

/// SplitMix64 (Steele, Lea, Flood 2014): the same cases on every machine.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A sequence of its own for each seed.
    pub fn new(seed: u64) -> Self {
        Random(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `n`; 0 of nothing.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    fn of<'a, T: ?Sized>(&mut self, items: &[&'a T]) -> Option<&'a T> {
        items.get(self.below(items.len())).copied()
    }
}

/// How a file is damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Its words and numbers are exchanged, repeated, left out.
    Text,
    /// Its bytes and its 2-, 4- and 8-byte numbers are.
    Binary,
}

/// No case is longer, bytes.
pub const LONGEST: usize = 1 << 17;

/// Numbers at which readers stumble.
const NUMBERS: [&str; 24] = [
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "1e-300",
    "1e308",
    "-1e308",
    "1e400",
    "nan",
    "inf",
    "-inf",
    "0.1",
    "127",
    "128",
    "255",
    "256",
    "32768",
    "65536",
    "2147483647",
    "2147483648",
    "4294967295",
    "18446744073709551615",
    "99999999999999999999",
];

/// The same for binary fields.
const FIELDS: [u64; 16] = [
    0,
    1,
    2,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7ff0_0000_0000_0000,
    0x7ff8_0000_0000_0000,
    0x7fff_ffff_ffff_ffff,
    u64::MAX,
    0x4000_0000,
];

/// A damaged file made of one of `seeds`, with pieces of the others.
pub fn mutate(random: &mut Random, seeds: &[Vec<u8>], form: Form) -> Vec<u8> {
    let all: Vec<&[u8]> = seeds.iter().map(Vec::as_slice).collect();
    let (Some(seed), Some(other)) = (random.of(&all), random.of(&all)) else {
        return Vec::new();
    };
    let changes = 1 + random.below(6);
    let mut bytes = match form {
        // one text in eight is damaged byte by byte
        Form::Text if random.below(8) > 0 => text(random, seed, other, changes),
        Form::Text | Form::Binary => binary(random, seed, other, changes),
    };
    bytes.truncate(LONGEST);
    bytes
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Class {
    Number,
    Word,
    LineEnd,
    Other,
}

fn class(token: &[u8]) -> Class {
    match token {
        [b'\n', ..] => Class::LineEnd,
        [b'0'..=b'9', ..] | [b'-' | b'+' | b'.', b'0'..=b'9', ..] => Class::Number,
        [c, ..] if c.is_ascii_alphabetic() || *c == b'_' => Class::Word,
        _ => Class::Other,
    }
}

/// Numbers, words, line ends, and every other character by itself.
fn tokens(text: &[u8]) -> Vec<&[u8]> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(&first) = rest.first() {
        let signed =
            matches!(first, b'-' | b'+' | b'.') && rest.get(1).is_some_and(u8::is_ascii_digit);
        let run =
            |belongs: fn(u8) -> bool| rest.iter().skip(1).take_while(|b| belongs(**b)).count();
        let length = 1 + if first.is_ascii_digit() || signed {
            run(|b| b.is_ascii_digit() || matches!(b, b'.' | b'e' | b'E'))
        } else if first.is_ascii_alphabetic() || first == b'_' {
            run(|b| b.is_ascii_alphanumeric() || matches!(b, b'_'))
        } else {
            0
        };
        let (token, after) = rest.split_at(length);
        found.push(token);
        rest = after;
    }
    found
}

fn text(random: &mut Random, seed: &[u8], other: &[u8], changes: usize) -> Vec<u8> {
    let mut list = tokens(seed);
    let pool = tokens(other);
    for _ in 0..changes {
        if list.is_empty() {
            break;
        }
        let at = random.below(list.len());
        let numbers: Vec<usize> = (0..list.len())
            .filter(|&i| class(list[i]) == Class::Number)
            .collect();
        let number = numbers.get(random.below(numbers.len())).copied();
        match random.below(10) {
            0 | 1 => {
                if let (Some(i), Some(value)) = (number, random.of(&NUMBERS)) {
                    list[i] = value.as_bytes();
                }
            }
            // a number or a word by one of the same class
            2..=4 => {
                let kind = class(list[at]);
                let same: Vec<&[u8]> = pool.iter().copied().filter(|t| class(t) == kind).collect();
                if let Some(token) = random.of(&same) {
                    list[at] = token;
                }
            }
            5 => {
                let count = 1 + random.below(4);
                list.drain(at..(at + count).min(list.len()));
            }
            6 => {
                if let Some(token) = random.of(&pool) {
                    list.insert(at, token);
                }
            }
            7 => lines(random, &mut list),
            8 => {
                let from = random.below(pool.len());
                let piece: Vec<&[u8]> = pool
                    .iter()
                    .skip(from)
                    .take(1 + random.below(40))
                    .copied()
                    .collect();
                list.splice(at..at, piece);
            }
            _ => {
                if random.below(4) == 0 {
                    list.truncate(at);
                } else if let Some(value) = random.of(&[
                    "\"", "'", "(", ")", "[", "]", "\u{e9}", "\u{feff}", "\0", "#", "$",
                ]) {
                    list[at] = value.as_bytes();
                }
            }
        }
    }
    list.concat()
}

/// A line is repeated, left out, or exchanged with another.
fn lines(random: &mut Random, list: &mut Vec<&[u8]>) {
    let mut all: Vec<Vec<&[u8]>> = list
        .split_inclusive(|t| class(t) == Class::LineEnd)
        .map(<[&[u8]]>::to_vec)
        .collect();
    let (a, b) = (random.below(all.len()), random.below(all.len()));
    match random.below(4) {
        0 => {
            all.remove(a);
        }
        1 => all.swap(a, b),
        2 => all.insert(b, all[a].clone()),
        _ => {
            let repeated = vec![all[a].clone(); 1 + random.below(50)];
            all.splice(a..a, repeated);
        }
    }
    *list = all.concat();
}

fn binary(random: &mut Random, seed: &[u8], other: &[u8], changes: usize) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..changes {
        if bytes.is_empty() {
            break;
        }
        let at = random.below(bytes.len());
        match random.below(8) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.next() as u8,
            // fields stand at multiples of their size more often than not
            2..=4 => {
                let width = [1, 2, 4, 8][random.below(4)];
                let start = if random.below(2) == 0 {
                    at
                } else {
                    at - at % width
                };
                let value = FIELDS[random.below(FIELDS.len())].to_le_bytes();
                for (byte, new) in bytes.iter_mut().skip(start).zip(&value[..width]) {
                    *byte = *new;
                }
            }
            5 => bytes.truncate(at),
            6 => {
                let end = (at + 1 + random.below(64)).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            _ => {
                let from = random.below(other.len());
                for (byte, new) in bytes
                    .iter_mut()
                    .skip(at)
                    .zip(other.iter().skip(from).take(1 + random.below(64)))
                {
                    *byte = *new;
                }
            }
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_same_cases_again_and_most_cases_differ() {
        let seeds = [
            b"speed = \"1.5 m/min\"\nn = 3\n".to_vec(),
            b"a,b\n1,-2e3\n".to_vec(),
        ];
        for form in [Form::Text, Form::Binary] {
            let cases = |seed| {
                let mut random = Random::new(seed);
                (0..200)
                    .map(|_| mutate(&mut random, &seeds, form))
                    .collect::<Vec<_>>()
            };
            assert_eq!(cases(1), cases(1));
            let mut different = cases(1);
            different.sort();
            different.dedup();
            assert!(different.len() > 100, "{}", different.len());
        }
    }

    #[test]
    fn tokens_are_numbers_words_and_characters_and_lose_nothing() {
        let text = b"x=-1.5e3,\"m/min\"\n";
        let found = tokens(text);
        let words: Vec<&str> = found
            .iter()
            .map(|t| std::str::from_utf8(t).unwrap())
            .collect();
        assert_eq!(
            words,
            ["x", "=", "-1.5e3", ",", "\"", "m", "/", "min", "\"", "\n"]
        );
        assert_eq!(found.concat(), text);
    }
}
