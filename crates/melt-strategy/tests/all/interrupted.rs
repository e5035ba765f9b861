//! A drawing that is interrupted goes on from its layers, and ends as if it had not been.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use meltpath_base::{Observer, Silent};
use meltpath_melt_strategy::bed::{Between, Body, Domain, Resolution};
use meltpath_melt_strategy::interrupted::Kept;
use meltpath_melt_strategy::judgement::{Drawn, judge};
use meltpath_thermal::beam::{Beam, BeamPath};
use meltpath_thermal::levels::LevelsError;
use meltpath_thermal::material::Material;
use meltpath_thermal::solver::source::Depth;

use crate::support::{on_metal, serpentine, titanium};

const LAYERS: usize = 3;

/// Stops everything once a folder holds a file.
struct Stop<'a>(&'a Path);

impl Observer for Stop<'_> {
    fn stage(&self, _: &str, _: u64) {}
    fn advance(&self, _: u64) {}
    fn cancelled(&self) -> bool {
        !files(self.0).is_empty()
    }
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let read = fs::read_dir(folder).into_iter().flatten();
    read.map(|f| f.unwrap().path()).collect()
}

fn drawn(
    material: &Material,
    path: &BeamPath,
    kept: Option<&Kept>,
    observer: &dyn Observer,
) -> Result<Drawn, LevelsError> {
    let beam = Beam {
        efficiency: 0.9,
        depth: Depth::Falling { penetration: 0.1 },
    };
    let between = Between {
        time: 0.02,
        powder: material.start,
    };
    let body = Body {
        between: Some(between),
        kept,
        ..on_metal(material, &beam)
    };
    let resolution = Resolution {
        cell: 0.1,
        planes: 1,
        step: 2e-5,
        domain: Domain {
            below: 0.8,
            beside: 0.8,
        },
        power: 1.0,
    };
    judge(
        &body,
        &vec![path.clone(); LAYERS],
        path,
        &resolution,
        observer,
    )
}

fn same(a: &Drawn, b: &Drawn) {
    assert_eq!(a.highest, b.highest);
    assert_eq!(a.layers, b.layers);
    let bits = |d: &Drawn| -> Vec<u32> {
        let fell = d.watched.freezing.fell.values.iter();
        fell.map(|v| v.to_bits()).collect()
    };
    assert!(bits(a) == bits(b));
    assert!(
        a.layers.len() == LAYERS + 1 && a.layers[LAYERS].before[0] > a.layers[0].before[0] + 1.0
    );
}

#[test]
fn an_interrupted_drawing_goes_on() {
    let metal = titanium();
    let path = serpentine(0.0, 1.0, |_| 0.6);
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path().join("interrupted");
    let now = || Kept::new(&home, Duration::ZERO);
    let whole = drawn(&metal, &path, None, &Silent).unwrap();

    let kept = now();
    let stopped = drawn(&metal, &path, Some(&kept), &Stop(&home));
    assert!(matches!(stopped, Err(LevelsError::Cancelled(_))));
    assert!(kept.layers() == 0 && kept.holds() && kept.trouble().is_none());
    let [file] = &files(&home)[..] else {
        panic!("{:?}", files(&home));
    };
    let bytes = fs::read(file).unwrap();

    // it goes on after the first layer
    let kept = now();
    same(&drawn(&metal, &path, Some(&kept), &Silent).unwrap(), &whole);
    assert_eq!(kept.layers(), 1);
    // of a run that was interrupted in its last layer all those below are there
    let kept = now();
    same(&drawn(&metal, &path, Some(&kept), &Silent).unwrap(), &whole);
    assert_eq!(kept.layers(), LAYERS);

    // what is damaged, cut off, or of another drawing serves nothing
    let mut damaged = bytes.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    for bytes in [&damaged, &bytes[..bytes.len() - 9].to_vec(), &Vec::new()] {
        fs::write(file, bytes).unwrap();
        let kept = now();
        same(&drawn(&metal, &path, Some(&kept), &Silent).unwrap(), &whole);
        assert_eq!(kept.layers(), 0);
    }
    let warm = Material {
        start: metal.start + 50.0,
        ..metal.clone()
    };
    let longer = serpentine(0.0, 1.0, |_| 0.7);
    for (metal, path) in [(&warm, &path), (&metal, &longer)] {
        let kept = now();
        drawn(metal, path, Some(&kept), &Silent).unwrap();
        assert_eq!(kept.layers(), 0);
    }
    // a folder of layers that this run did not use promises nothing
    assert!(!now().holds() && !files(&home).is_empty());
    // all layers go, whoever kept them; what somebody else put there stays, also his empty folder
    let notes = home.join("notes.layers");
    fs::write(&notes, "mine").unwrap();
    now().clear();
    assert_eq!(files(&home), std::slice::from_ref(&notes));
    fs::remove_file(notes).unwrap();
    now().clear();
    assert!(home.exists());
    let kept = now();
    drawn(&metal, &path, Some(&kept), &Silent).unwrap();
    assert!(kept.holds());
    kept.clear();
    assert!(!kept.holds() && files(folder.path()).is_empty());
}

/// Layers that take no time are drawn again; a folder that cannot be made is told and changes nothing.
#[test]
fn what_is_not_kept_is_drawn_again() {
    let metal = titanium();
    let path = serpentine(0.0, 0.6, |_| 0.4);
    let folder = tempfile::tempdir().unwrap();
    let home = folder.path().join("interrupted");
    let kept = Kept::new(&home, Duration::from_hours(1));
    let whole = drawn(&metal, &path, Some(&kept), &Silent).unwrap();
    assert!(!kept.holds());

    fs::write(&home, "a file").unwrap();
    let kept = Kept::new(&home, Duration::ZERO);
    same(&drawn(&metal, &path, Some(&kept), &Silent).unwrap(), &whole);
    assert!(kept.trouble().unwrap().contains("cannot write"));
}
