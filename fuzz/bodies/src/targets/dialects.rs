//! Programs for other controllers than FANUC's, each with its data behind it in one input.

use std::sync::OnceLock;

use meltpath_base::{Reporter, settings};
use meltpath_programs::{CellProgramming, Dialect, Program, dialect, reading};

use super::{Target, files};
use crate::mutate::Form;

/// The text of a cell that has words for every dialect.
pub(super) fn cell_text() -> String {
    let text = meltpath_data::cells::ARCMATE_120IC.text.replace(
        "name_length = 32",
        "name_length = 32\nblend = \"4 mm\"\narc_values = [\"schedule\", \"wire feed, m/min\", \"other\"]",
    );
    let words = "[program.krl]\nsource = \"fuzz\"\njob_mode = \"Job mode\"\n\
        [program.rapid]\nsource = \"fuzz\"\ntool = \"tTorch\"\nwork_object = \"wPart\"\nseam = \"sm1\"\n\
        [program.script]\nsource = \"fuzz\"\npart = \"plane\"\n\
        arc_start = [\"set_job({1})\", \"set_analog_out(0, {2})\", \"set_digital_out(0, True)\"]\n\
        arc_end = [\"set_digital_out(0, False)\"]\n\
        [program.inform]\nsource = \"fuzz\"\nzones = [\"0.5 mm\", \"1 mm\", \"2 mm\", \"4 mm\"]\n\
        [program.val3]\nsource = \"fuzz\"\npart_position = [\"500 mm\", \"0 mm\", \"100 mm\"]\n\
        tool_position = [\"0 mm\", \"0 mm\", \"330 mm\"]\n\
        arc_start = [\"nJob={1}\", \"aioSet(aoWire,{2})\", \"doArc=true\"]\narc_end = [\"doArc=false\"]\n\
        [[program.schedule]]\nnumber = 2\nwire_feed = \"8 m/min\"\nvalues = [2, 8, 0]\n";
    text + words
}

/// That cell.
fn cell() -> &'static CellProgramming {
    static CELL: OnceLock<CellProgramming> = OnceLock::new();
    CELL.get_or_init(|| settings::peek(&cell_text(), &["program"]).unwrap().unwrap())
}

fn rewritten(program: &Program) -> Option<(Vec<Vec<u8>>, Vec<Program>)> {
    let files = dialect::write(program, cell()).ok()?;
    let files: Vec<Vec<u8>> = files.into_iter().map(|f| f.text.into_bytes()).collect();
    let data = files.get(1).map(Vec::as_slice);
    let again = dialect::read(program.dialect, &files[0], data, cell());
    let again = again.expect("what is written can be read");
    Some((files, again.into_iter().map(|p| p.program).collect()))
}

/// What is read can be executed, written, read again, and then written as the same.
fn programs(which: Dialect, bytes: &[u8], data: Option<&str>) {
    let at = data.and_then(|mark| {
        let mut places = bytes.windows(mark.len());
        places.position(|w| w == mark.as_bytes())
    });
    let (source, data) = match at {
        Some(at) => (&bytes[..at], Some(&bytes[at..])),
        None => (bytes, None),
    };
    let Ok(all) = dialect::read(which, source, data, cell()) else {
        return;
    };
    let all: Vec<Program> = all.into_iter().map(|p| p.program).collect();
    let settings = cell().execution(10.0);
    if let Ok(read) = reading::read_toolpath(&all, &settings, 1000.0, &Reporter::new()) {
        for layer in &read.toolpath.layers {
            layer.sanity_check().expect("what is read is sound");
        }
    }
    for program in &all {
        let Some((_, again)) = rewritten(program) else {
            continue;
        };
        // numbers beyond a file's digits change once; from then on nothing does
        let Some((files, again)) = again.first().and_then(rewritten) else {
            continue;
        };
        if let Some((same, _)) = again.first().and_then(rewritten) {
            assert!(
                same == files,
                "what is written again changes: {files:#?} {same:#?}"
            );
        }
    }
}

const DATA: &str = "crates/programs/tests/data";

/// Files of a dialect, each with the data of the project behind it.
fn seeds(ending: &str, data: &[&str]) -> Vec<Vec<u8>> {
    let mut all = files(DATA, &[ending], 1 << 16);
    if !data.is_empty() {
        let data = files(DATA, data, 1 << 16).concat();
        for seed in &mut all {
            seed.extend(&data);
        }
    }
    all
}

/// KUKA: `.src`, behind it its `.dat`.
pub(super) const KRL: Target = Target {
    name: "krl",
    form: Form::Text,
    seeds: || seeds("src", &["dat"]),
    body: |bytes| programs(Dialect::Krl, bytes, Some("DEFDAT")),
};

/// ABB modules.
pub(super) const RAPID: Target = Target {
    name: "rapid",
    form: Form::Text,
    seeds: || seeds("mod", &[]),
    body: |bytes| programs(Dialect::Rapid, bytes, None),
};

/// Scripts of Universal Robots.
pub(super) const UR_SCRIPT: Target = Target {
    name: "ur_script",
    form: Form::Text,
    seeds: || seeds("script", &[]),
    body: |bytes| programs(Dialect::UrScript, bytes, None),
};

/// Yaskawa jobs.
pub(super) const INFORM: Target = Target {
    name: "inform",
    form: Form::Text,
    seeds: || seeds("JBI", &[]),
    body: |bytes| programs(Dialect::Inform, bytes, None),
};

/// Stäubli programs, behind them the data of their project.
pub(super) const VAL3: Target = Target {
    name: "val3",
    form: Form::Text,
    seeds: || seeds("pgx", &["dtx"]),
    body: |bytes| programs(Dialect::Val3, bytes, Some("<Database")),
};
