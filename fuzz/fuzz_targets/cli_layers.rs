//! The reader of CLI layer files on any bytes: never a panic, and what is read can be written and read again in both forms.

#![no_main]

use libfuzzer_sys::fuzz_target;
use meltpath_programs::cli;

fuzz_target!(|bytes: &[u8]| {
    let Ok(file) = cli::parse(bytes) else {
        return;
    };
    if let Ok(text) = cli::write_ascii(&file) {
        let again = cli::parse(text.as_bytes()).expect("what is written can be read");
        assert_eq!(again.layers, file.layers);
    }
    if let Ok(binary) = cli::write_binary(&file) {
        let again = cli::parse(&binary).expect("what is written can be read");
        assert_eq!(again.layers.len(), file.layers.len());
    }
});
