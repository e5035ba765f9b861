//! Why programs lay no metal that is known here.

use std::mem::discriminant;

use meltpath_programs::Gap;

/// Lines that were not simulated, by their kinds: how many, the first of each, and what to do. Those with most lines first.
pub(super) fn reasons(gaps: &[Gap]) -> String {
    let mut kinds: Vec<(&Gap, usize)> = Vec::new();
    for gap in gaps {
        let same = |(first, _): &&mut (&Gap, usize)| {
            discriminant(&first.why) == discriminant(&gap.why)
                && first.why.remedy() == gap.why.remedy()
        };
        match kinds.iter_mut().find(same) {
            Some((_, count)) => *count += 1,
            None => kinds.push((gap, 1)),
        }
    }
    kinds.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let words = kinds.iter().map(|(first, count)| {
        let Gap {
            program,
            line,
            text,
            why,
        } = first;
        let place = match count {
            1 => format!("at {program}, line {line}, \"{text}\""),
            _ => format!("in {count} lines, first at {program}, line {line}, \"{text}\""),
        };
        format!("{place}: {why}; {}", why.remedy())
    });
    words.collect::<Vec<_>>().join(" | ")
}
