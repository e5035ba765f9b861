//! Sintered powder beside a section: named by the job, conducting by its density or as it was measured, and warmed by the part.

use std::path::Path;

use crate::support::{refusal, says};
use meltpath::chain;
use meltpath::outcome::RunFolder::At;
use meltpath_base::Silent;

/// Lines over 2 x 0.8 mm. A place 0.2 mm beside it and a layer below the ground's top is looked at, and one in its middle.
fn job(ebm: &str) -> String {
    format!(
        "[process]\nkind = \"ebm\"\n[ebm]\n{ebm}[region]\ncontour = [[\"0 mm\", \"0 mm\"], [\"2 mm\", \"0 mm\"], [\"2 mm\", \"0.8 mm\"], [\"0 mm\", \"0.8 mm\"]]\n[hatch]\nspacing = \"0.1 mm\"\ncurrent = \"3 mA\"\n[charts]\npreview = \"none\"\n[window]\nlow = \"1700 °C\"\nhigh = \"9000 °C\"\nmodel = \"solver\"\n[judge]\ncell = \"62.5 µm\"\nplaces = [[\"1 mm\", \"-0.2 mm\", \"-0.1 mm\"], [\"1 mm\", \"0.4 mm\"]]\n"
    )
}

/// The highest temperatures of the two places, °C.
fn highest(folder: &Path, name: &str, ebm: &str) -> [f64; 2] {
    let file = folder.join("job.toml");
    std::fs::write(&file, job(ebm)).unwrap();
    let out = folder.join(name);
    chain::run(&file, At(&out), &Silent).unwrap();
    let text = std::fs::read_to_string(out.join("series/temperatures-reference.csv")).unwrap();
    let mut lines = text.lines();
    let heads: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |wanted: &str| heads.iter().position(|h| *h == wanted).unwrap();
    let (y, kelvin) = (at("y_mm"), at("T_C"));
    let mut highest = [0.0_f64; 2];
    for line in lines {
        let cells: Vec<f64> = line.split(',').map(|c| c.parse().unwrap()).collect();
        let n = usize::from(cells[y] > 0.0);
        highest[n] = highest[n].max(cells[kelvin]);
    }
    highest
}

#[test]
fn heat_flows_into_the_cake_beside_a_section() {
    let dir = tempfile::tempdir().unwrap();
    let of = |name: &str, ebm: &str| highest(dir.path(), name, ebm);
    let metal = of("metal", "");
    let cake = of("cake", "ground = \"cake\"\n");
    let measured = of(
        "measured",
        "ground = \"cake\"\npowder_conductivity = \"measured\"\n",
    );
    println!("beside and in the middle, °C: metal {metal:?}, cake {cake:?}, measured {measured:?}");
    for [beside, _] in [metal, cake, measured] {
        assert!(beside > 760.0, "{beside}");
    }
    // what leaves less quickly through the sides leaves the section hotter, the less they conduct
    assert!(cake[1] > metal[1] && measured[1] > cake[1]);
    assert!(cake[0] != metal[0] && measured[0] != cake[0]);
}

#[test]
fn cake_that_cannot_be_is_refused_in_its_place() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("job.toml");
    let refused = |text: &str, said: &str| {
        std::fs::write(&file, text).unwrap();
        says(&refusal(&file), &[said]);
    };
    let cake = job("ground = \"cake\"\n");
    let again = cake.replace(
        "[hatch]",
        "supported = [[\"0 mm\", \"0 mm\"], [\"2 mm\", \"0 mm\"], [\"0 mm\", \"1 mm\"]]\n[hatch]",
    );
    refused(&again, "region.supported says where metal lies below");
    let path = "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on\n0,0,0,60000,0.005,0.004,1\n0.001,1,0,60000,0.005,0.004,1\n";
    std::fs::write(dir.path().join("path.csv"), path).unwrap();
    refused(
        "path = \"path.csv\"\n[process]\nkind = \"ebm\"\n[ebm]\nground = \"cake\"\n",
        "no region is written",
    );
    refused(
        &job("material = \"in625-laser\"\npowder_conductivity = \"measured\"\n"),
        "no [powder_conductivity]",
    );
}
