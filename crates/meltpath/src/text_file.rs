//! Files of text: UTF-8, and what is told of others.

use std::io::{Error, ErrorKind, Result};
use std::path::Path;

/// The text of a file.
///
/// # Errors
/// What the system says; of a text that is not UTF-8, where, and what to do.
pub(crate) fn read(path: &Path) -> Result<String> {
    text(std::fs::read(path)?)
}

fn text(bytes: Vec<u8>) -> Result<String> {
    String::from_utf8(bytes).map_err(|e| {
        let bytes = e.as_bytes();
        let first = e.utf8_error().valid_up_to();
        let wrong = if matches!(bytes, [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..]) {
            "it is UTF-16 text".to_owned()
        } else {
            let line = 1 + bytes.iter().take(first).filter(|&&b| b == b'\n').count();
            format!("line {line} is not UTF-8 text")
        };
        let told = format!("{wrong}: save the file as UTF-8 (plain text) in the editor");
        Error::new(ErrorKind::InvalidData, told)
    })
}

#[cfg(test)]
mod tests {
    use super::text;

    #[test]
    fn text_in_another_encoding_is_told_with_its_line() {
        let told = |bytes: &[u8]| text(bytes.to_vec()).map_err(|e| e.to_string());
        assert_eq!(told("# größe\n".as_bytes()).unwrap(), "# größe\n");
        let latin = told(b"a = 1\n# gr\xf6\xdfe\n").unwrap_err();
        assert!(latin.starts_with("line 2 is not UTF-8"), "{latin}");
        let wide = told(b"\xff\xfea\0").unwrap_err();
        assert!(
            wide.contains("UTF-16") && wide.contains("save the file as UTF-8"),
            "{wide}"
        );
    }
}
