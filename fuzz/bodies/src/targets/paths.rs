//! Paths: controllers' programs, layer files, vector lists, beam paths, the native container.

use std::collections::BTreeMap;

use meltpath_base::Reporter;
use meltpath_base::container::{Column, Container};
use meltpath_gun::record::Record;
use meltpath_programs::cli::{self, CliError, Reader};
use meltpath_programs::{ExecutionSettings, fanuc_ls, reading, vectors};
use meltpath_thermal::charts::{
    Chart, ChartSet, ChartSettings, CoolingCurve, HeatingCurve, WarmGround, file as chart_file,
};
use meltpath_toolpath::{Layer, Profile, Toolpath, storage};

use super::{Target, files};
use crate::mutate::Form;

/// FANUC programs: what is read can be executed, written, and read again.
pub(super) const FANUC_LS: Target = Target {
    name: "fanuc_ls",
    form: Form::Text,
    seeds: || files("crates/programs/tests/data", &["ls"], 1 << 16),
    body: |bytes| {
        let Ok(parsed) = fanuc_ls::read(bytes) else {
            return;
        };
        let programs = std::slice::from_ref(&parsed.program);
        let settings = ExecutionSettings::default();
        let read = reading::read_toolpath(programs, &settings, 1000.0, &Reporter::new());
        if let Ok(read) = read {
            let moves: usize = read.toolpath.passes().map(|p| p.move_count()).sum();
            assert_eq!(moves, read.controls.len());
            for layer in &read.toolpath.layers {
                layer.sanity_check().expect("what is read is sound");
            }
        }
        if let Ok(text) = fanuc_ls::write(&parsed.program) {
            let again = fanuc_ls::parse(&text).expect("what is written can be read");
            assert_eq!(
                fanuc_ls::write(&again.program).expect("and written again"),
                text
            );
        }
    },
};

const LAYERS: &str = "$$HEADERSTART\n$$ASCII\n$$UNITS/0.01\n$$VERSION/200\n$$LABEL/1,part one\n$$LAYERS/2\n$$HEADEREND\n$$GEOMETRYSTART\n\
    $$LAYER/5.0\n$$POLYLINE/1,1,5,0,0,1000,0,1000,1000,0,1000,0,0\n$$HATCHES/1,2,0,0,100,50,10,10,100,60\n\
    $$LAYER/10.0\n$$POLYLINE/1,0,4,100,100,100,200,200,200,100,100\n$$POLYLINE/1,2,2,0,0,7,9\n$$GEOMETRYEND\n";

/// Numbers and words at the edge of the format, for pieces.
const EDGES: &[u8] = b"4294967295 -1 1e308 1e-308 NaN inf , / // $$\n$$LAYER/\n$$POLYLINE/1,1,99999999,\n$$HATCHES/1,1,0,0,1,1\n\
    $$UNITS/0\n$$BINARY\n$$GEOMETRYEND\n\xff\xff\xff\xff\x82\0\x84\0\x80\0";

fn read_layers(bytes: &[u8]) -> Result<Vec<Layer>, CliError> {
    Reader::new(bytes)?.collect()
}

fn write_layers(layers: &[Layer], form: cli::Form) -> Result<Vec<u8>, CliError> {
    let mut bytes = Vec::new();
    let mut writer = cli::Writer::new(&mut bytes, form, &BTreeMap::new(), Some(layers.len()))?;
    for layer in layers {
        writer.layer(layer)?;
    }
    writer.finish()?;
    Ok(bytes)
}

fn layers(bytes: &[u8]) {
    let Ok(layers) = read_layers(bytes) else {
        return;
    };
    if let Ok(text) = write_layers(&layers, cli::Form::Ascii) {
        let again = read_layers(&text).expect("what is written can be read");
        assert_eq!(again, layers);
    }
    if let Ok(binary) = write_layers(&layers, cli::Form::Binary) {
        let again = read_layers(&binary).expect("what is written can be read");
        assert_eq!(again.len(), layers.len());
    }
}

/// Layer files as text.
pub(super) const CLI_LAYERS: Target = Target {
    name: "cli_layers",
    form: Form::Text,
    seeds: || vec![LAYERS.as_bytes().to_vec(), EDGES.to_vec()],
    body: layers,
};

/// Layer files, binary.
pub(super) const CLI_BINARY: Target = Target {
    name: "cli_binary",
    form: Form::Binary,
    seeds: || {
        let layers = read_layers(LAYERS.as_bytes()).unwrap();
        vec![write_layers(&layers, cli::Form::Binary).unwrap()]
    },
    body: layers,
};

/// Vector lists.
pub(super) const VECTOR_LIST: Target = Target {
    name: "vector_list",
    form: Form::Text,
    seeds: || {
        vec![
            b"kind,x [mm],y [mm],z [mm],speed [mm/s],power [W],wait [s],part,layer,height [mm]\nstart,0,0,0,,,,1,1,0.03\n\
            contour,10,0,0,1500,180,,1,1,\ncontour,10,10,,,,0.0003,1,1,\njump,0,1,,5000,,,1,1,\nfill,10,1,,1500,200,,1,1,\n\
            connection,10,2,,,,,1,1,\nrun,11,2,,,,,1,1,\nstart,0,0,0,,,,1,2,0.06\nfill,3,4,,1500,200,,1,2,\n"
                .to_vec(),
            b"kind;x [mm];y [mm]\n# a comment\nstart;0;0\ncontour;1,5;2\n".to_vec(),
        ]
    },
    body: |bytes| {
        let read = |bytes| vectors::Reader::new(bytes)?.collect::<Result<Vec<Layer>, _>>();
        let Ok(layers) = read(bytes) else {
            return;
        };
        let mut text = Vec::new();
        let mut writer = vectors::Writer::new(&mut text).expect("a vector takes it");
        let written = layers.iter().try_for_each(|l| writer.layer(l)).is_ok();
        if written && writer.finish().is_ok() {
            let again = read(&text).expect("what is written can be read");
            assert_eq!(again, layers);
        }
    },
};

/// Beam paths as CSV.
pub(super) const BEAM_PATH: Target = Target {
    name: "beam_path",
    form: Form::Text,
    seeds: || {
        vec![
            b"t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n0,0,0,60000,0.005,0.004,1\n0.001,1,0,60000,0.005,0.004,1\n0.001,1,2,60000,0.005,0.004,0\n\
            0.002,-1,2,60000,0.008,0.004,1\n# a comment\n0.003,-1,3,60000,0,0.004,0\n"
                .to_vec(),
        ]
    },
    body: |bytes| {
        if let Ok(record) = Record::from_csv(bytes) {
            let again = Record::from_csv(record.to_csv().as_bytes());
            assert_eq!(again.expect("what is written can be read"), record);
        }
    },
};

/// A toolpath as stored: its head, its layers, its end.
fn stored() -> Vec<Container> {
    let toolpath = Toolpath {
        profiles: vec![Profile::default(); 2],
        layers: read_layers(LAYERS.as_bytes()).unwrap(),
        ..Toolpath::default()
    };
    let mut bytes = Vec::new();
    storage::write(&toolpath, &mut bytes).unwrap();
    let mut rest = bytes.as_slice();
    let mut parts = Vec::new();
    while !rest.is_empty() {
        parts.push(Container::read(&mut rest).unwrap());
    }
    parts
}

fn bytes_of(containers: &[Container]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for container in containers {
        container.write(&mut bytes).unwrap();
    }
    bytes
}

fn read_toolpath(mut bytes: &[u8]) {
    if let Ok(toolpath) = storage::read(&mut bytes) {
        // NaN is not itself, so what is written is compared, not the values
        let written = |toolpath: &Toolpath| {
            let mut bytes = Vec::new();
            storage::write(toolpath, &mut bytes).unwrap();
            bytes
        };
        let first = written(&toolpath);
        let again = storage::read(&mut first.as_slice()).expect("what is written can be read");
        assert_eq!(written(&again), first);
    }
}

/// Native containers as they lie on a disk.
pub(super) const CONTAINER: Target = Target {
    name: "container",
    form: Form::Binary,
    seeds: || vec![bytes_of(&stored())],
    body: read_toolpath,
};

/// What the index of a stored layer says of its columns, checksums being right.
pub(super) const TOOLPATH_INDEX: Target = Target {
    name: "toolpath_index",
    form: Form::Text,
    seeds: || vec![stored()[1].meta.to_string().into_bytes()],
    body: |json| {
        let mut containers = stored();
        if let Ok(meta) = serde_json::from_slice(json) {
            containers[1].meta = meta;
            read_toolpath(&bytes_of(&containers));
        }
    },
};

/// Charts of two depths, two distances and one share of powder, on cold ground and on warm.
fn charts() -> Container {
    let rising = |n: usize| (0..n).map(|i| i as f32 * 1e-5).collect::<Vec<f32>>();
    let heating = HeatingCurve {
        end: 10.0,
        times: rising(129),
    };
    let cooling = CoolingCurve {
        from: 8.0,
        to: 1.0,
        times: rising(513),
    };
    let chart = Chart {
        powder_share: 0.0,
        heating: vec![heating; 4],
        cooling: vec![cooling; 2],
    };
    let set = ChartSet {
        settings: ChartSettings::for_beam(60.0, 0.3),
        material: "Ti-6Al-4V".to_owned(),
        fingerprint: 1,
        depths: vec![0.0, 0.025],
        distances: vec![0.0, 0.025],
        charts: vec![chart.clone()],
        warm: vec![WarmGround {
            temperature: 1000.0,
            enthalpy: 2.0,
            charts: vec![chart],
        }],
    };
    let mut bytes = Vec::new();
    chart_file::write(&set, &mut bytes).unwrap();
    Container::read(&mut bytes.as_slice()).unwrap()
}

/// What a file of charts says, checksums being right: its settings and its columns but those of times, which are cut to a length.
pub(super) const CHARTS: Target = Target {
    name: "charts",
    form: Form::Text,
    seeds: || {
        let container = charts();
        let columns: serde_json::Map<String, serde_json::Value> = container
            .columns
            .iter()
            .map(|(name, column)| {
                let json = match column {
                    Column::F32(values) if name.ends_with("times") => values.len().into(),
                    Column::F32(values) => serde_json::json!(values),
                    Column::F64(values) => serde_json::json!(values),
                    _ => serde_json::Value::Null,
                };
                (name.clone(), json)
            })
            .collect();
        let json = serde_json::json!({ "meta": container.meta, "columns": columns });
        vec![serde_json::to_vec_pretty(&json).unwrap()]
    },
    body: |bytes| {
        let _ = chart_file::read(&mut &bytes[..]);
        let Ok(json) = serde_json::from_slice::<serde_json::Value>(bytes) else {
            return;
        };
        let mut container = charts();
        container.meta = json["meta"].clone();
        for (name, column) in &mut container.columns {
            let told = &json["columns"][name];
            let numbers = || -> Vec<f64> {
                let all = told.as_array().into_iter().flatten();
                all.filter_map(serde_json::Value::as_f64).collect()
            };
            match column {
                Column::F32(values) if name.ends_with("times") => {
                    let length = told.as_u64().unwrap_or(0).min(1 << 16);
                    values.resize(length as usize, 1.0);
                }
                Column::F32(values) => *values = numbers().iter().map(|v| *v as f32).collect(),
                Column::F64(values) => *values = numbers(),
                _ => {}
            }
        }
        let read = chart_file::read(&mut bytes_of(&[container]).as_slice());
        if let Ok(set) = read {
            let mut written = Vec::new();
            chart_file::write(&set, &mut written).unwrap();
            let again = chart_file::read(&mut written.as_slice());
            assert_eq!(again.expect("what is written can be read"), set);
        }
    },
};
