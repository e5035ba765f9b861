//! Statements of a module with their lines: up to a semicolon, or a line that needs none; comments apart.

use crate::parsed::trimmed;
use crate::scan::{is_variable, strip_word};

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
        let mut rest = line.chars();
        while let Some(c) = rest.next() {
            quoted ^= c == '"';
            let labels = |piece: &Statement| is_variable(piece.text.trim());
            match c {
                '!' if !quoted => break,
                ';' if !quoted => all.extend(open.take()),
                // `again: MoveL …`
                ':' if !rest.as_str().starts_with('=') && open.as_ref().is_some_and(labels) => {
                    let label = open.take();
                    all.extend(label.map(|piece| Statement {
                        text: format!("{}:", piece.text.trim()),
                        ..piece
                    }));
                }
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

/// What begins a routine of the module, and what ends it.
const ROUTINES: [(&str, &str); 3] = [
    ("PROC", "ENDPROC"),
    ("FUNC", "ENDFUNC"),
    ("TRAP", "ENDTRAP"),
];

/// Which statements stand outside of all routines: what is declared there counts in all of them.
pub(super) fn outside(all: &[Statement]) -> Vec<bool> {
    let mut end = None;
    let stands = |s: &Statement| {
        if let Some(word) = end {
            if s.text.eq_ignore_ascii_case(word) {
                end = None;
            }
            return false;
        }
        let head = strip_word(&s.text, "LOCAL").map_or(&*s.text, str::trim_start);
        let begun = ROUTINES.iter().find(|(w, _)| strip_word(head, w).is_some());
        end = begun.map(|(_, end)| *end);
        end.is_none()
    };
    all.iter().map(stands).collect()
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
        let text = "MODULE m\n again:\nnext: ConfL\\Off; ConfJ\\Off;\n !a;b\n MoveL p1,\n  v100; ! c\nTPWrite \"a;!b\";\nENDMODULE\n";
        let found: Vec<(u32, String)> = statements(text)
            .into_iter()
            .map(|s| (s.line, s.text))
            .collect();
        let wanted = [
            (1, "MODULE m"),
            (2, "again:"),
            (3, "next:"),
            (3, "ConfL\\Off"),
            (3, "ConfJ\\Off"),
            (4, "!a;b"),
            (5, "MoveL p1,   v100"),
            (7, "TPWrite \"a;!b\""),
            (8, "ENDMODULE"),
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
