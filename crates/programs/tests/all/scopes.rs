//! What runs first, whose data count where, and what ends a program: modules and scripts of several routines.

use meltpath_base::Reporter;
use meltpath_programs::{Dialect, Program, Reading, dialect, read_toolpath};

use crate::dialects::cell;
use crate::told::motions;

fn all(dialect: Dialect, text: &str) -> Vec<Program> {
    let parsed = dialect::read(dialect, text.as_bytes(), None, &cell(&[100.0])).unwrap();
    parsed.into_iter().map(|p| p.program).collect()
}

fn run(programs: &[Program]) -> Reading {
    let settings = cell(&[100.0]).execution(10.0);
    read_toolpath(programs, &settings, 1000.0, &Reporter::new()).unwrap()
}

/// Where the beads of a text end, y and z, mm.
fn beads(dialect: Dialect, text: &str) -> Vec<[f64; 2]> {
    let moves = motions(&run(&all(dialect, text)));
    let laid = moves.iter().filter(|m| m.burns);
    laid.map(|m| [m.to.y, m.to.z]).collect()
}

/// A module of these data and routines.
fn module(text: &str) -> String {
    format!(
        "MODULE m
PERS welddata wd1:=[10,0,[4,8,0,0,0,0,0,0,0],[0,0,0,0,0,0,0,0,0]];
{text}
ENDMODULE
"
    )
}

fn target(y: f64, z: f64) -> String {
    format!("[[30,{y},{z}],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]")
}

/// A bead to a target, from where the arm stands.
fn bead(to: &str) -> String {
    let from = "[[0,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
    format!("ArcLStart {from},v20,sm1,wd1,fine,tTorch;\nArcLEnd {to},v10,sm1,wd1,fine,tTorch;")
}

/// The controller begins with `main`, wherever it stands in the module.
#[test]
fn a_module_begins_with_main() {
    let routine = |name: &str, y: f64| {
        let laid = bead(&target(y, 0.0));
        format!("PROC {name}()\n{laid}\nENDPROC")
    };
    let text = module(&format!(
        "{}\n{}\nPROC Main()\nWall;\nRib;\nWall;\nENDPROC",
        routine("Wall", 1.0),
        routine("Rib", 9.0)
    ));
    let programs = all(Dialect::Rapid, &text);
    let names: Vec<&str> = programs.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["Main", "Wall", "Rib"]);
    let ys: Vec<f64> = beads(Dialect::Rapid, &text)
        .iter()
        .map(|[y, _]| *y)
        .collect();
    assert_eq!(ys, [1.0, 9.0, 1.0]);
}

/// Data that a routine declares hide those of the module in it alone.
#[test]
fn data_of_a_routine_count_in_it_alone() {
    let (eight, nought, laid) = (target(8.0, 0.0), target(0.0, 0.0), bead("p1"));
    let text = module(&format!(
        "CONST robtarget p1:={eight};
PROC main()
{laid}
ENDPROC
PROC Probe()
CONST robtarget p1:={nought};
MoveL p1,v20,fine,tTorch;
ENDPROC"
    ));
    assert_eq!(beads(Dialect::Rapid, &text), [[8.0, 0.0]]);
    // the other way round
    let text = module(&format!(
        "CONST robtarget p1:={nought};
PROC main()
CONST robtarget p1:={eight};
{laid}
Next;
ENDPROC
PROC Next()
{laid}
ENDPROC"
    ));
    assert_eq!(beads(Dialect::Rapid, &text), [[8.0, 0.0], [0.0, 0.0]]);
    // numbers of both
    let up = bead("Offs(p1,0,0,h)");
    let text = module(&format!(
        "CONST robtarget p1:={nought};
CONST num h:=2;
PROC main()
{up}
ENDPROC
PROC Other()
VAR num h:=5;
{up}
ENDPROC"
    ));
    assert_eq!(beads(Dialect::Rapid, &text), [[0.0, 2.0]]);
}

/// A routine that is called takes constants of the one that calls by their values, and its own data hide none of what it is given.
#[test]
fn arguments_are_those_of_the_routine_that_calls() {
    let (eight, nought) = (target(8.0, 0.0), target(0.0, 0.0));
    let lay = |declares: &str| {
        let laid = bead("to");
        format!("PROC Lay(robtarget to)\n{declares}\n{laid}\nENDPROC")
    };
    let main = |declares: &str| format!("PROC main()\n{declares}\nLay p1;\nENDPROC");
    let module_data = format!("CONST robtarget p1:={nought};");
    let own = format!("CONST robtarget p1:={eight};");
    let given = [
        (main(""), lay(""), Some(0.0)),
        (main(&own), lay(""), Some(8.0)),
        // whose p1 it is then is not followed: told, not laid at the other one
        (main(""), lay(&own), None),
    ];
    for (main, lay, wanted) in given {
        let text = module(&format!("{module_data}\n{main}\n{lay}"));
        let reading = run(&all(Dialect::Rapid, &text));
        let moves = motions(&reading);
        let laid: Vec<f64> = moves.iter().filter(|m| m.burns).map(|m| m.to.y).collect();
        assert_eq!(laid, wanted.into_iter().collect::<Vec<f64>>(), "{text}");
        assert_eq!(
            reading.gaps.is_empty(),
            wanted.is_some(),
            "{:?}",
            reading.gaps
        );
    }
}

/// `EXIT` ends a module wherever it stands, and labels are no instructions.
#[test]
fn a_module_ends_where_it_says_so() {
    let (first, second) = (bead(&target(1.0, 0.0)), bead(&target(2.0, 0.0)));
    let text = module(&format!(
        "PROC main()\nagain: {first}\nStops;\n{second}\nlast:\nENDPROC\nPROC Stops()\nEXIT;\nENDPROC"
    ));
    let programs = all(Dialect::Rapid, &text);
    let reading = run(&programs);
    assert_eq!(reading.gaps, []);
    assert_eq!(beads(Dialect::Rapid, &text), [[1.0, 0.0]]);
}

/// Lines of a script outside its functions are what runs, as often as they say.
#[test]
fn lines_outside_functions_run() {
    let function = |name: &str, y: f64| {
        format!(
            "def {name}():
  movel(pose_trans(Part,p[0,0,0.01,3.14159265,0,0]),v=0.1)
  set_job(1)
  set_analog_out(0, 6)
  set_digital_out(0, True)
  movel(pose_trans(Part,p[0.03,{y},0,3.14159265,0,0]),v=0.01)
  set_digital_out(0, False)
end
"
        )
    };
    let both = function("wall", 0.001) + &function("rib", 0.009);
    let ys = |behind: &str| -> Vec<f64> {
        let all = beads(Dialect::UrScript, &format!("{both}{behind}"));
        all.iter().map(|[y, _]| *y).collect()
    };
    // nothing calls: the last one runs
    assert_eq!(ys(""), [9.0]);
    assert_eq!(ys("# wall()\nspeed = 0.1\n"), [9.0]);
    assert_eq!(ys("wall()\nrib()\n"), [1.0, 9.0]);
    assert_eq!(
        ys("i = 0\nwhile i < 3:\n  wall()\n  i = i + 1\nend\n"),
        [1.0; 3]
    );
}

/// A base that lies in one of the controller's by numbers: moves in it are told in that one.
#[test]
fn a_base_within_the_controllers_own_is_told_in_it() {
    let to = |base: &str| {
        let text = format!(
            "DEF K( )\n$TOOL=TOOL_DATA[1]\n$BASE={base}\nPTP {{X 0,Y 0,Z 9,A 0,B 0,C 180}}\nPTP {{X 1,Y 2,Z 5,A 0,B 0,C 180}}\nEND\n"
        );
        let programs = all(Dialect::Krl, &text);
        let settings = cell(&[100.0]).execution(10.0);
        let reading = read_toolpath(&programs, &settings, 1000.0, &Reporter::new()).unwrap();
        assert_eq!(reading.gaps, []);
        let moved = motions(&reading)[0].to;
        (moved.to_array().map(|v| (1e6 * v).round() / 1e6), programs)
    };
    assert_eq!(to("BASE_DATA[1]").0, [1.0, 2.0, 5.0]);
    let (moved, programs) = to("BASE_DATA[1]:{X 10,Y 50,Z 5,A 90,B 0,C 0}");
    assert_eq!(moved, [8.0, 51.0, 10.0]);
    assert_eq!(programs[0].said_frames.unread, []);
}
