//! Text made safe inside HTML, SVG and XML, and JSON made safe inside a script element.

use std::borrow::Cow;

/// `text` with the five special characters replaced, and characters that XML 1.0 forbids shown as `�`.
///
/// ```
/// use meltpath_report::escape::escape;
/// assert_eq!(escape("a < b & \"c\""), "a &lt; b &amp; &quot;c&quot;");
/// assert_eq!(escape("bead 1"), "bead 1");
/// ```
pub fn escape(text: &str) -> Cow<'_, str> {
    let forbidden = |c: char| c.is_control() && !matches!(c, '\n' | '\t' | '\r');
    let special = |c: char| matches!(c, '&' | '<' | '>' | '"' | '\'') || forbidden(c);
    if !text.contains(special) {
        return Cow::Borrowed(text);
    }
    let mut safe = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            c if forbidden(c) => safe.push('\u{fffd}'),
            c => safe.push(c),
        }
    }
    Cow::Owned(safe)
}

/// JSON that can stand inside `<script type="application/json">`: no `<` is left to end the element.
pub fn json_for_script(value: &serde_json::Value) -> String {
    // `<` occurs only inside strings, where its escape means the same
    value.to_string().replace('<', "\\u003c")
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn no_special_character_is_left(text in any::<String>()) {
            let safe = escape(&text);
            prop_assert!(!safe.contains(['<', '>', '"', '\'']));
            let back = safe.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"")
                .replace("&#39;", "'").replace("&amp;", "&");
            if !text.chars().any(char::is_control) {
                prop_assert_eq!(back, text);
            }
        }
    }

    #[test]
    fn a_script_element_cannot_be_closed_from_json() {
        let json = serde_json::json!({"name": "</script><script>alert(1)</script>"});
        let text = json_for_script(&json);
        assert!(!text.contains('<'));
        let back: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(back, json);
    }
}
