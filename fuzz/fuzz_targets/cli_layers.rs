//! The reader of CLI layer files on any bytes: never a panic, and what is read can be written and read again in both forms.

#![no_main]

use libfuzzer_sys::fuzz_target;
use meltpath_programs::cli::{CliError, Form, Reader, Writer};
use meltpath_toolpath::Layer;

fn read(bytes: &[u8]) -> Result<Vec<Layer>, CliError> {
    Reader::new(bytes)?.collect()
}

fn written(layers: &[Layer], form: Form) -> Result<Vec<u8>, CliError> {
    let mut bytes = Vec::new();
    let mut writer = Writer::new(&mut bytes, form, &Default::default(), Some(layers.len()))?;
    for layer in layers {
        writer.layer(layer)?;
    }
    writer.finish()?;
    Ok(bytes)
}

fuzz_target!(|bytes: &[u8]| {
    let Ok(layers) = read(bytes) else {
        return;
    };
    if let Ok(text) = written(&layers, Form::Ascii) {
        assert_eq!(read(&text).expect("what is written can be read"), layers);
    }
    if let Ok(binary) = written(&layers, Form::Binary) {
        let again = read(&binary).expect("what is written can be read");
        assert_eq!(again.len(), layers.len());
    }
});
