//! One fuzz target: the body of its name, and the mutator that knows its form beside libFuzzer's own.

pub use libfuzzer_sys;
pub use meltpath_fuzz_bodies as bodies;

/// The fuzz target of a name.
#[macro_export]
macro_rules! target {
    ($name:literal) => {
        use std::sync::OnceLock;

        use $crate::bodies::mutate::{Random, mutate};
        use $crate::bodies::{Target, named};
        use $crate::libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};

        fn it() -> &'static (&'static Target, Vec<Vec<u8>>) {
            static IT: OnceLock<(&'static Target, Vec<Vec<u8>>)> = OnceLock::new();
            IT.get_or_init(|| {
                let target = named($name);
                (target, (target.seeds)())
            })
        }

        fuzz_target!(|bytes: &[u8]| (it().0.body)(bytes));

        fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
            // one case in four is left to libFuzzer, which knows what it covered
            if seed % 4 == 0 {
                return fuzzer_mutate(data, size, max_size);
            }
            let (target, seeds) = it();
            let own = vec![data[..size].to_vec()];
            let from = if size < 8 || seed % 16 == 1 { seeds } else { &own };
            let case = mutate(&mut Random::new(seed.into()), from, target.form);
            let size = case.len().min(max_size);
            data[..size].copy_from_slice(&case[..size]);
            size
        });
    };
}
