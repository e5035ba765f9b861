//! A program to text.

use std::fmt::Write as _;

use super::{line, positions};
use crate::program::{Attribute, Program};
use crate::written::{WriteError, check};

/// The text of a program, with `\n` line ends. Coordinates have three decimals: 1 µm and 0.001°.
///
/// # Errors
/// [`WriteError`] where a number is not finite, or a text holds what ends a line.
pub fn write(program: &Program) -> Result<String, WriteError> {
    check(program)?;
    let mut text = String::new();
    // writing to a String cannot fail
    let _ = writeln!(
        text,
        "{}",
        format!("/PROG  {}\t{}", program.name, program.kind).trim_end()
    );
    text.push_str("/ATTR\n");
    for attribute in &program.attributes {
        write_attribute(&mut text, attribute);
    }
    if !program.application.is_empty() {
        text.push_str("/APPL\n");
        for line in &program.application {
            let _ = writeln!(text, "{line}");
        }
    }
    for section in &program.sections {
        let _ = writeln!(text, "/{}", section.name);
        for line in &section.lines {
            let _ = writeln!(text, "{line}");
        }
    }
    text.push_str("/MN\n");
    for (i, instruction) in program.instructions.iter().enumerate() {
        let _ = writeln!(text, "{:>4}:{} ;", i + 1, line::write(instruction));
    }
    text.push_str("/POS\n");
    for position in &program.positions {
        positions::write(&mut text, position);
    }
    text.push_str("/END\n");
    Ok(text)
}

fn write_attribute(text: &mut String, attribute: &Attribute) {
    let Attribute { key, value } = attribute;
    let _ = if key == "TCD" {
        let items: Vec<_> = value.split(',').map(str::trim).collect();
        // one item a line, as controllers print it, where nothing in them can be taken for a section
        let plain = |item: &&str| item.starts_with(|c: char| c.is_ascii_alphabetic());
        let between = if items.iter().all(plain) {
            ",\n      "
        } else {
            ", "
        };
        writeln!(text, "TCD:  {};", items.join(between))
    } else {
        writeln!(text, "{key}\t\t= {value};")
    };
}
