//! Walking through the text of a line: words, brackets, numbers. Never indexes out of the text.

/// `text` without `word` in front, in any case; the word must not go on.
pub(crate) fn strip_word<'a>(text: &'a str, word: &str) -> Option<&'a str> {
    let rest = strip_prefix(text, word)?;
    let goes_on = rest.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
    (!goes_on).then_some(rest)
}

/// `text` without `prefix` in front, in any case.
pub(crate) fn strip_prefix<'a>(text: &'a str, prefix: &str) -> Option<&'a str> {
    let head = text.get(..prefix.len())?;
    head.eq_ignore_ascii_case(prefix)
        .then(|| &text[prefix.len()..])
}

/// `text` before its last word, where that is `word`.
pub(crate) fn before_last_word<'a>(text: &'a str, word: &str) -> Option<&'a str> {
    let at = text.len().checked_sub(word.len())?;
    let last = text.get(at..)?;
    last.eq_ignore_ascii_case(word).then(|| text[..at].trim())
}

/// Whether a text is the name of a variable, or of a component of one, such as `p10.trans.z`.
pub(crate) fn is_variable(text: &str) -> bool {
    let part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.');
    text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.chars().all(part)
}

/// The next word up to white space outside brackets and quotes, and what follows it.
pub(crate) fn word(text: &str) -> Option<(&str, &str)> {
    let text = text.trim_start();
    let (mut depth, mut quoted) = (0_u32, false);
    let end = text.char_indices().find(|&(_, c)| {
        match c {
            '"' | '\'' => quoted = !quoted,
            '[' | '(' if !quoted => depth += 1,
            ']' | ')' if !quoted => depth = depth.saturating_sub(1),
            _ => {}
        }
        c.is_whitespace() && depth == 0 && !quoted
    });
    let (head, rest) = text.split_at(end.map_or(text.len(), |(i, _)| i));
    (!head.is_empty()).then_some((head, rest))
}

/// What stands in a bracket that opens `text`, and what follows it.
pub(crate) fn bracket(text: &str) -> Option<(&str, &str)> {
    let inner = text.strip_prefix('[')?;
    let mut depth = 1_u32;
    let mut quoted = false;
    for (i, c) in inner.char_indices() {
        match c {
            '"' => quoted = !quoted,
            '[' if !quoted => depth += 1,
            ']' if !quoted => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return Some((&inner[..i], &inner[i + 1..]));
        }
    }
    None
}

/// A number with an optional comment, as brackets hold them: `3`, `3:home`, `3:"home"`.
pub(crate) fn numbered(inner: &str) -> Option<(u32, Option<String>)> {
    let (number, comment) = inner
        .split_once(':')
        .map_or((inner, None), |(n, c)| (n, Some(c)));
    // quotes and brackets would not be read back where they stand
    let comment = comment.map(|c| tidy(&c.replace(['"', '[', ']'], "")));
    Some((
        number.trim().parse().ok()?,
        comment.filter(|c| !c.is_empty()),
    ))
}

/// A finite number at the start of `text`, and what follows it.
pub(crate) fn number(text: &str) -> Option<(f64, &str)> {
    let end = text
        .find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '+' | '-')))
        .unwrap_or(text.len());
    let (head, rest) = text.split_at(end);
    let value: f64 = head.parse().ok()?;
    value.is_finite().then_some((value, rest))
}

/// A text that is a finite number and nothing else.
pub(crate) fn finite(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|v: &f64| v.is_finite())
}

/// A duration, s: a finite number that is not below zero.
pub(crate) fn duration(text: &str) -> Option<f64> {
    finite(text).filter(|seconds| *seconds >= 0.0)
}

/// The finite numbers between commas.
pub(crate) fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(finite).collect()
}

/// The letters and digits in front of `text`.
pub(crate) fn first_word(text: &str) -> &str {
    let mut words = text.split(|c: char| !c.is_ascii_alphanumeric());
    words.next().unwrap_or_default()
}

/// The letters, digits and underscores in front of `text`, and what follows them.
pub(crate) fn identifier(text: &str) -> (&str, &str) {
    let end = text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    text.split_at(end.unwrap_or(text.len()))
}

/// The parts between commas outside brackets, parentheses and quotes.
pub(crate) fn arguments(text: &str) -> Vec<&str> {
    let (mut depth, mut quoted) = (0_i32, false);
    text.split(|c: char| {
        quoted ^= c == '"';
        match c {
            '[' | '(' | '{' if !quoted => depth += 1,
            ']' | ')' | '}' if !quoted => depth -= 1,
            _ => {}
        }
        c == ',' && depth == 0 && !quoted
    })
    .map(str::trim)
    .collect()
}

/// The arguments of a call, such as `movel(p,v)`.
pub(crate) fn called<'a>(text: &'a str, name: &str) -> Option<Vec<&'a str>> {
    let inner = text
        .strip_prefix(name)?
        .trim_start()
        .strip_prefix('(')?
        .strip_suffix(')')?;
    Some(arguments(inner))
}

/// The name of a routine at the start of its head, before its parameters.
pub(crate) fn routine_name(head: &str) -> Option<&str> {
    let name = head.split('(').next().unwrap_or_default().trim();
    let part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '$');
    let begins = name.starts_with(|c: char| part(c) && !c.is_ascii_digit());
    (begins && name.chars().all(part)).then_some(name)
}

/// White space in runs made single, ends trimmed.
pub(crate) fn tidy(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A line of KRL without the comment that follows it.
pub(crate) fn uncommented(line: &str) -> &str {
    let mut quoted = false;
    let end = line.find(|c: char| {
        quoted ^= c == '"';
        c == ';' && !quoted
    });
    line[..end.unwrap_or(line.len())].trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_keep_their_brackets() {
        assert_eq!(
            word("  Start[20.5V, 190A] x"),
            Some(("Start[20.5V, 190A]", " x"))
        );
        assert_eq!(word("P[1:\"a b\"] 5%"), Some(("P[1:\"a b\"]", " 5%")));
        assert_eq!(word("   "), None);
        assert_eq!(bracket("[R[3]] CNT"), Some(("R[3]", " CNT")));
        assert_eq!(bracket("[1"), None);
        assert_eq!(numbered("3:\"home\""), Some((3, Some("home".into()))));
        assert_eq!(number("75.0cm/min"), Some((75.0, "cm/min")));
        assert_eq!(number(".5(sec)"), Some((0.5, "(sec)")));
        assert_eq!(strip_word("CALLER", "CALL"), None);
        assert_eq!(strip_prefix("é", "ab"), None);
    }
}
