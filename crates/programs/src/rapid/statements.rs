//! Statements of a module with their lines: up to a semicolon, or a line that needs none; comments apart.

use crate::parsed::trimmed;

/// A piece of a module.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Statement {
    /// Line on which it begins, from 1.
    pub(super) line: u32,
    /// Its text on one line, without the semicolon; comments with their `!`.
    pub(super) text: String,
}

/// First words of lines that end without a semicolon.
const OPEN: [&str; 27] = [
    "MODULE",
    "ENDMODULE",
    "PROC",
    "ENDPROC",
    "FUNC",
    "ENDFUNC",
    "TRAP",
    "ENDTRAP",
    "RECORD",
    "ENDRECORD",
    "IF",
    "ELSEIF",
    "ELSE",
    "ENDIF",
    "FOR",
    "ENDFOR",
    "WHILE",
    "ENDWHILE",
    "TEST",
    "CASE",
    "DEFAULT",
    "ENDTEST",
    "ERROR",
    "UNDO",
    "BACKWARD",
    "LOCAL PROC",
    "LOCAL FUNC",
];

/// The statements of a text.
pub(super) fn statements(text: &str) -> Vec<Statement> {
    let mut all = Vec::new();
    let mut open: Option<Statement> = None;
    for (line, n) in trimmed(text).zip(1..) {
        if open.is_none() {
            if line.is_empty() {
                continue;
            }
            if ends_itself(line) {
                all.push(Statement {
                    line: n,
                    text: line.to_owned(),
                });
                continue;
            }
        }
        let mut quoted = false;
        for c in line.chars() {
            quoted ^= c == '"';
            match c {
                '!' if !quoted => break,
                ';' if !quoted => all.extend(open.take()),
                _ => {
                    let piece = open.get_or_insert_with(|| Statement {
                        line: n,
                        text: String::new(),
                    });
                    piece.text.push(c);
                }
            }
        }
        if let Some(piece) = &mut open {
            // a text ends on its line
            piece.text.push_str(if quoted { "\" " } else { " " });
        }
        // what is left behind the last semicolon may be nothing
        open = open.filter(|piece| !piece.text.trim().is_empty());
    }
    all.extend(open);
    for statement in &mut all {
        statement.text = statement.text.trim().to_owned();
    }
    all.retain(|s| !s.text.is_empty());
    all
}

pub(super) fn ends_itself(line: &str) -> bool {
    let upper = line.to_ascii_uppercase();
    let upper = upper.split_whitespace().collect::<Vec<_>>().join(" ");
    let open = OPEN.iter().any(|word| {
        let rest = upper.strip_prefix(word);
        rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_'))
    });
    line.starts_with('!') || (open && !line.ends_with(';'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::arguments;

    #[test]
    fn statements_end_with_a_semicolon() {
        let text = "MODULE m\n ConfL\\Off; ConfJ\\Off;\n !a;b\n MoveL p1,\n  v100; ! c\nTPWrite \"a;!b\";\nENDMODULE\n";
        let found: Vec<(u32, String)> = statements(text)
            .into_iter()
            .map(|s| (s.line, s.text))
            .collect();
        let wanted = [
            (1, "MODULE m"),
            (2, "ConfL\\Off"),
            (2, "ConfJ\\Off"),
            (3, "!a;b"),
            (4, "MoveL p1,   v100"),
            (6, "TPWrite \"a;!b\""),
            (7, "ENDMODULE"),
        ];
        let tidy = |s: &str| s.split_whitespace().collect::<Vec<_>>().join(" ");
        let found: Vec<(u32, String)> = found.into_iter().map(|(n, t)| (n, tidy(&t))).collect();
        assert_eq!(found, wanted.map(|(n, t)| (n, tidy(t))));
        assert_eq!(
            arguments("[1,2],v100\\V:=(3,4),\"a,b\""),
            ["[1,2]", "v100\\V:=(3,4)", "\"a,b\""]
        );
    }
}
