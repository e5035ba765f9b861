//! A program to text.

use std::fmt::Write as _;

use super::{line, positions};
use crate::program::{Attribute, Coordinates, Instruction, Program, Speed};

/// Why a program cannot be written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WriteError {
    /// A coordinate or a speed is infinite or not a number.
    #[error("program {program}: {what} is not finite or too small to write; nothing is written")]
    NotFinite {
        /// Program.
        program: String,
        /// Which number.
        what: String,
    },
    /// A text would break the file: a line break or, in a header, a semicolon.
    #[error("program {program}: {what} holds a character that programs cannot hold: {text:?}")]
    Text {
        /// Program.
        program: String,
        /// Which text.
        what: &'static str,
        /// That text.
        text: String,
    },
}

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

fn check(program: &Program) -> Result<(), WriteError> {
    let infinite = |what: String| {
        Err(WriteError::NotFinite {
            program: program.name.clone(),
            what,
        })
    };
    for position in &program.positions {
        for group in &position.groups {
            let finite = match &group.coordinates {
                Coordinates::Cartesian {
                    xyz,
                    wpr_degrees,
                    external,
                    ..
                } => {
                    xyz.iter().chain(wpr_degrees).all(|v| v.is_finite())
                        && external.iter().all(|a| a.value.is_finite())
                }
                Coordinates::Joint(axes) => axes.iter().all(|a| a.value.is_finite()),
                Coordinates::Unread(_) => true,
            };
            if !finite {
                return infinite(format!("position P[{}]", position.index));
            }
        }
    }
    for (i, instruction) in program.instructions.iter().enumerate() {
        let finite = match instruction {
            Instruction::Motion(m) => match m.speed {
                // less would be written as zero
                Speed::Value { value, .. } => value.is_finite() && value >= 1e-3,
                Speed::Register { .. } | Speed::Weld | Speed::Maximum => true,
            },
            Instruction::Wait(seconds) => seconds.is_finite() && *seconds >= 0.0,
            _ => true,
        };
        if !finite {
            return infinite(format!("the speed or time in line {}", i + 1));
        }
        if let Instruction::Comment { text, .. } | Instruction::Raw(text) = instruction
            && text.contains(['\n', '\r'])
        {
            return Err(WriteError::Text {
                program: program.name.clone(),
                what: "a comment or instruction",
                text: text.clone(),
            });
        }
    }
    for attribute in &program.attributes {
        if attribute.value.contains(['\n', '\r']) {
            return Err(WriteError::Text {
                program: program.name.clone(),
                what: "the header",
                text: attribute.value.clone(),
            });
        }
    }
    Ok(())
}
