//! Programs of others that say in numbers where their frames lie: the part lies in the frame that the cell file names. And words for what lays no metal here.

use std::path::Path;

use crate::dialects::cell;
use crate::support::{check, says, warned, write};
use meltpath::inspect::{How, inspect};
use meltpath::job::PartUnit;
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::{run, simulate_program};
use meltpath_base::{Reporter, Silent, Status, Verdict};

/// A bead of 100 mm in `object`, in a module that declares where these objects lie in y, mm, against the wall of the thin wall.
fn simulated(home: &Path, object: &str, declared: &[(&str, f64)]) -> Verdict {
    let declared: Vec<String> = declared
        .iter()
        .map(|(name, y)| {
            format!("PERS wobjdata {name}:=[FALSE,TRUE,\"\",[[500,0,100],[1,0,0,0]],[[0,{y},0],[1,0,0,0]]];\n")
        })
        .collect();
    let declared = declared.concat();
    let to =
        |x: f64, z: f64| format!("[[{x},0,{z}],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]");
    let module = format!(
        "MODULE m\n{declared}PERS welddata wd1:=[12.5,0,[4,8,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];\nPROC main()\n\
         MoveJ {},v100,fine,tTorch\\WObj:={object};\nArcLStart {},v100,sm1,wd1,fine,tTorch\\WObj:={object};\n\
         ArcLEnd {},v100,sm1,wd1,fine,tTorch\\WObj:={object};\nMoveL {},v100,fine,tTorch\\WObj:={object};\nENDPROC\nENDMODULE\n",
        to(0.0, 50.0),
        to(0.0, 0.0),
        to(100.0, 0.0),
        to(100.0, 50.0)
    );
    let program = write(home, "m.mod", module);
    let job = crate::support::thin_wall(
        home,
        "[machine]\ncell = \"cell.toml\"\n[simulation]\ncell = \"1 mm\"\n",
    );
    std::fs::write(home.join("cell.toml"), cell("abb-rapid")).unwrap();
    simulate_program(&program, Some(&job), NextIn(&home.join("runs")), &Silent)
        .unwrap()
        .verdict
}

#[test]
fn the_part_lies_in_the_frame_that_the_cell_names() {
    let dir = tempfile::tempdir().unwrap();
    let lack = |object: &str, declared: &[(&str, f64)]| {
        let verdict = simulated(dir.path(), object, declared);
        let lack = check(&verdict, "lack").value.as_ref().unwrap().value;
        (lack, warned(&verdict, "part-frame"))
    };
    let (own, told) = lack("wPart", &[("wPart", 0.0)]);
    assert!(!told);
    // the same place, told in another frame
    let near = |(found, noted): (f64, bool), note| (found - own).abs() < 0.1 && noted == note;
    assert!(near(lack("wB", &[("wPart", 0.0), ("wB", 0.0)]), false));
    // and 7 mm beside: the bead of another frame is not that of the part's
    let (beside, told) = lack("wB", &[("wPart", 0.0), ("wB", 7.0)]);
    assert!(!told);
    assert!(beside > own + 1.0, "{beside} {own}");
    // where the cell's frame lies nobody says
    assert!(near(lack("wB", &[("wB", 7.0)]), true));
}

#[test]
fn files_and_lines_are_told_as_what_they_are() {
    let dir = tempfile::tempdir().unwrap();
    let how = How {
        unit: PartUnit::Millimetre,
        chord: 0.05,
    };
    let text = "/PROG P\n/MN\n1: R[1]=0 ;\n2: IF R[1]=0,JMP LBL[1] ;\n3: MESSAGE[on] ;\n4: Touch Offset PR[5] ;\n5: LBL[1] ;\n/POS\n/END\n";
    let program = write(dir.path(), "p.ls", text);
    let told = inspect(&program, how, &Reporter::new(), &Silent)
        .unwrap()
        .join("\n");
    for words in [
        "is executed as far as its values are known: R[1]=0",
        "is executed as far as its values are known: IF R[1]=0,JMP LBL[1]",
        "lays no metal: MESSAGE[on]",
        "is kept but not simulated: Touch Offset PR[5]",
    ] {
        assert!(told.contains(words), "{words}: {told}");
    }
    let runs = dir.path().join("runs");
    let refused = |name: &str, text: &str| {
        let program = write(dir.path(), name, text);
        let outcome = simulate_program(&program, None, NextIn(&runs), &Silent);
        outcome.unwrap_err().to_string()
    };
    let told = refused("notes.txt", "hello");
    assert!(told.contains("KUKA") && told.contains(".JBI"), "{told}");
    let position = "P[1]{\n GP1:\n UF : 1, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = 0 mm, Y = 0 mm, Z = 0 mm, W = 180 deg, P = 0 deg, R = 0 deg\n};\n";
    let text = format!(
        "/PROG P\n/MN\n1: UFRAME_NUM=1 ;\n2: UTOOL_NUM=1 ;\n3:L P[1] 10mm/sec FINE ;\n4: !Schedule 1 WFS 8.00 m/min ;\n5: Arc Start[1] ;\n6: WAIT 2.00(sec) ;\n7: Arc End[1] ;\n/POS\n{position}/END\n"
    );
    let told = refused("stands.ls", &text);
    assert!(
        told.contains("starts the arc") && !told.contains("never"),
        "{told}"
    );
}

/// A part that a program places aslope in numbers was taken to lie level where no robot's file placed it: a wall on a table of 45° passed.
#[test]
fn a_part_that_a_program_places_aslope_is_not_decided_about() {
    let dir = tempfile::tempdir().unwrap();
    let home = dir.path().join("job");
    std::fs::create_dir(&home).unwrap();
    std::fs::write(home.join("cell.toml"), crate::dialects::cell("kuka-krl")).unwrap();
    let job = crate::dialects::job(&home, "cell = \"cell.toml\"", "");
    let own = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
    assert!(own.verdict.checks.iter().all(|c| c.id != "tilt"));
    let source = own.folder.join("program/JOB.src");
    let text = std::fs::read_to_string(&source).unwrap();
    let selected = "$TOOL=TOOL_DATA[1]";
    assert!(text.contains(selected), "{text}");
    for (slope, told) in [(0.5, false), (45.0, true)] {
        let base = format!("{selected}\n$BASE={{X 500,Y 0,Z 300,A 0,B {slope},C 0}}");
        let edited = dir.path().join("edited");
        std::fs::create_dir_all(&edited).unwrap();
        std::fs::write(edited.join("JOB.src"), text.replacen(selected, &base, 1)).unwrap();
        std::fs::copy(source.with_extension("dat"), edited.join("JOB.dat")).unwrap();
        let source = edited.join("JOB.src");
        let again = simulate_program(&source, Some(&job), NextIn(&home.join("again")), &Silent);
        let verdict = again.unwrap().verdict;
        let tilt = verdict.checks.iter().find(|c| c.id == "tilt");
        assert_eq!(tilt.is_some(), told, "{slope}: {tilt:?}");
        if let Some(tilt) = tilt {
            let angle = tilt.value.as_ref().unwrap().value;
            assert!((angle - slope).abs() < 1e-6, "{angle}");
            assert_ne!(tilt.status, Status::Pass, "{tilt:?}");
            says(&tilt.reason, &["if the robot stands upright"]);
            says(&check(&verdict, "lack").reason, &["from level"]);
        }
    }
}
