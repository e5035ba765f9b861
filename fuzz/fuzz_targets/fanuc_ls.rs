//! The FANUC parser on any bytes: never a panic, and what is read can be written and read again.
//! Seeds: `crates/programs/tests/data`.

#![no_main]

use libfuzzer_sys::fuzz_target;
use meltpath_base::Reporter;
use meltpath_programs::{ExecutionSettings, execution_order, fanuc_ls};

fuzz_target!(|bytes: &[u8]| {
    let Ok(parsed) = fanuc_ls::read(bytes) else {
        return;
    };
    let programs = std::slice::from_ref(&parsed.program);
    let _ = execution_order(programs, &ExecutionSettings::default(), &Reporter::new());
    if let Ok(text) = fanuc_ls::write(&parsed.program) {
        let again = fanuc_ls::parse(&text).expect("what is written can be read");
        assert_eq!(fanuc_ls::write(&again.program).expect("and written again"), text);
    }
});
