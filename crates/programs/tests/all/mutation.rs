//! The parser on damaged and random text: an error or a program, never a panic; and what it reads it can write and read again.

use meltpath_base::Reporter;
use meltpath_programs::{ExecutionSettings, fanuc_ls, read_toolpath};
use proptest::prelude::*;

const SAMPLES: [&str; 3] = [
    include_str!("../data/offline_simple.ls"),
    include_str!("../data/controller_two_groups.ls"),
    include_str!("../data/lower_case_logic.ls"),
];

/// Reads, writes, reads again, executes.
fn exercise(bytes: &[u8]) -> Result<(), TestCaseError> {
    let Ok(parsed) = fanuc_ls::read(bytes) else {
        return Ok(());
    };
    let read = read_toolpath(
        std::slice::from_ref(&parsed.program),
        &ExecutionSettings::default(),
        1000.0,
        &Reporter::new(),
    );
    if let Ok(reading) = read {
        let moves: usize = reading.toolpath.passes().map(|p| p.move_count()).sum();
        prop_assert_eq!(moves, reading.controls.len());
        for layer in &reading.toolpath.layers {
            prop_assert_eq!(layer.sanity_check(), Ok(()));
        }
    }
    let Ok(text) = fanuc_ls::write(&parsed.program) else {
        return Ok(());
    };
    let again = fanuc_ls::parse(&text)
        .map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?
        .program;
    let once_more = fanuc_ls::write(&again).map_err(|e| TestCaseError::fail(e.to_string()))?;
    let different = once_more.lines().zip(text.lines()).find(|(a, b)| a != b);
    prop_assert_eq!(different, None);
    prop_assert_eq!(once_more.len(), text.len());
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_programs(sample in 0_usize..3, changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8), cut in any::<prop::sample::Index>(), cuts in any::<bool>()) {
        let mut bytes = SAMPLES[sample].as_bytes().to_vec();
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if cuts {
            bytes.truncate(cut.index(bytes.len()));
        }
        exercise(&bytes)?;
    }

    #[test]
    fn shuffled_pieces(pieces in proptest::collection::vec((0_usize..3, any::<prop::sample::Index>(), 1_usize..40), 0..30)) {
        let mut text = "/PROG A\n/MN\n".to_owned();
        for (sample, at, n) in pieces {
            let chars: Vec<_> = SAMPLES[sample].chars().collect();
            let at = at.index(chars.len());
            text.extend(chars[at..].iter().take(n));
        }
        text += "\n/END\n";
        exercise(text.as_bytes())?;
    }

    #[test]
    fn random_lines(lines in proptest::collection::vec("[JLCA]? ?P?R?\\[?[0-9:\"a]{0,4}\\]? ?[0-9.]{0,5}(mm/sec|cm/min|%|sec)? ?(FINE|CNT[0-9]{0,3})? ?(Arc Start\\[1\\]|Weld End\\[1,1\\]|ACC80|;|!|//|:)?", 0..12)) {
        let text = format!("/PROG A\n/MN\n{}\n/END\n", lines.join("\n"));
        exercise(text.as_bytes())?;
    }
}
