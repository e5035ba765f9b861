//! Paths: controllers' programs, layer files, vector lists, beam paths, the native container.

use meltpath_base::Reporter;
use meltpath_base::container::Container;
use meltpath_programs::{ExecutionSettings, cli, execution_order, fanuc_ls, vectors};
use meltpath_thermal::beam::BeamPath;
use meltpath_toolpath::storage;

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
        let _ = execution_order(programs, &ExecutionSettings::default(), &Reporter::new());
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

fn layers(bytes: &[u8]) {
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
}

/// Layer files as text.
pub(super) const CLI_LAYERS: Target = Target {
    name: "cli_layers",
    form: Form::Text,
    seeds: || vec![LAYERS.as_bytes().to_vec()],
    body: layers,
};

/// Layer files, binary.
pub(super) const CLI_BINARY: Target = Target {
    name: "cli_binary",
    form: Form::Binary,
    seeds: || vec![cli::write_binary(&cli::parse(LAYERS.as_bytes()).unwrap()).unwrap()],
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
        let Ok(text) = std::str::from_utf8(bytes) else {
            return;
        };
        if let Ok(layers) = vectors::parse(text) {
            let again =
                vectors::parse(&vectors::write(&layers)).expect("what is written can be read");
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
        if let Ok(path) = BeamPath::from_csv(bytes) {
            let again = BeamPath::from_csv(path.to_csv().as_bytes());
            assert_eq!(
                again.expect("what is written can be read").points(),
                path.points()
            );
        }
    },
};

fn toolpath() -> Container {
    let file = cli::parse(LAYERS.as_bytes()).unwrap();
    storage::to_container(&file.to_toolpath(
        meltpath_toolpath::Profile::default(),
        meltpath_toolpath::Profile::default(),
    ))
}

fn read_toolpath(container: &Container) {
    if let Ok(toolpath) = storage::from_container(container) {
        let again = storage::from_container(&storage::to_container(&toolpath));
        // NaN is not itself, so the columns are compared, not the values
        let written = |t| {
            let mut bytes = Vec::new();
            storage::to_container(t).write(&mut bytes).unwrap();
            bytes
        };
        assert_eq!(
            written(&again.expect("what is written can be read")),
            written(&toolpath)
        );
    }
}

/// Native containers as they lie on a disk.
pub(super) const CONTAINER: Target = Target {
    name: "container",
    form: Form::Binary,
    seeds: || {
        let mut bytes = Vec::new();
        toolpath().write(&mut bytes).unwrap();
        vec![bytes]
    },
    body: |mut bytes| {
        if let Ok(container) = Container::read(&mut bytes) {
            read_toolpath(&container);
        }
    },
};

/// What a container's index says of its columns, checksums being right.
pub(super) const TOOLPATH_INDEX: Target = Target {
    name: "toolpath_index",
    form: Form::Text,
    seeds: || vec![toolpath().meta.to_string().into_bytes()],
    body: |json| {
        let mut container = toolpath();
        if let Ok(meta) = serde_json::from_slice(json) {
            container.meta = meta;
            read_toolpath(&container);
        }
    },
};
