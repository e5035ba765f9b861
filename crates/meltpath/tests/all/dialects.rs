//! Programs for other controllers than FANUC's, from job to verdict: written, read back, simulated, never judged by FANUC's corners.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::support::{check, says, thin_wall};
use meltpath::outcome::RunFolder::NextIn;
use meltpath::waam::program::wanted::{Restart, Torch, Wanted};
use meltpath::waam::{LeftOpen, examine, plan_to_file, program_to_folder, run, simulate_program};
use meltpath_base::{Check, Reporter, Silent, Status, Verdict};
use meltpath_data::{cells, find, robots};

/// The shipped cell for another controller, of which nobody says how it goes round corners.
pub(crate) fn cell(dialect: &str) -> String {
    let text = cells::ARCMATE_120IC.text;
    let (head, rest) = text.split_once("[motion]").unwrap();
    let (_, program) = rest.split_once("[program]").unwrap();
    let mut text = format!(
        "{head}[program]\ndialect = \"{dialect}\"\nblend = \"2 mm\"\narc_values = [\"schedule\", \"wire feed, m/min\"]\n{program}"
    );
    // its number is ours, the job of the source is called 4
    text += "[[program.schedule]]\nnumber = 1\nwire_feed = \"8 m/min\"\nvalues = [4, 8]\n";
    text + "[program.krl]\nsource = \"test\"\njob_mode = \"CMT\"\n\
        [program.rapid]\nsource = \"test\"\ntool = \"tTorch\"\nwork_object = \"wPart\"\nseam = \"sm1\"\n\
        [program.script]\nsource = \"test\"\npart = \"Part\"\narc_start = [\"set_job({1})\", \"set_digital_out(0, True)\"]\n\
        arc_end = [\"set_digital_out(0, False)\"]\n\
        [program.inform]\nsource = \"test\"\nzones = [\"0.5 mm\", \"1 mm\", \"2 mm\"]\n\
        [program.val3]\nsource = \"test\"\npart_position = [\"500 mm\", \"0 mm\", \"0 mm\"]\n\
        tool_position = [\"8.6036 mm\", \"0 mm\", \"342.2873 mm\"]\ntool_angles = [\"0 deg\", \"35 deg\", \"0 deg\"]\n\
        arc_start = [\"nJob={1}\", \"doArc=true\"]\narc_end = [\"doArc=false\"]\n"
}

pub(crate) fn job(folder: &Path, machine: &str, rest: &str) -> PathBuf {
    thin_wall(
        folder,
        &format!(
            "[waam.bead]\nwire_feed = \"8 m/min\"\ntravel_speed = \"0.75 m/min\"\n\
             [layers]\ncount = 2\n[machine]\n{machine}\n[simulation]\ncell = \"1 mm\"\n{rest}"
        ),
    )
}

fn names(folder: &Path) -> Vec<String> {
    let files = std::fs::read_dir(folder.join("program")).unwrap();
    let mut names: Vec<String> = files
        .map(|f| f.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// A job for a controller and a robot, and its folder, after which programs are called.
pub(crate) fn job_for(folder: &Path, dialect: &str, robot: &str) -> (PathBuf, PathBuf) {
    let home = folder.join("job");
    std::fs::create_dir(&home).unwrap();
    std::fs::write(home.join("cell.toml"), cell(dialect)).unwrap();
    let machine = format!("cell = \"cell.toml\"\nrobot = \"{robot}\"");
    let job = job(&home, &machine, "");
    (home, job)
}

/// A job that lets the arc stand, and the mass of wire of the same without and with it, kg, with the check of missing metal.
fn standing(dialect: &str, robot: &str, [from, to]: [&str; 2]) -> ([f64; 2], Check) {
    let dir = tempfile::tempdir().unwrap();
    let (home, job) = job_for(dir.path(), dialect, robot);
    let told = || {
        let outcome = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
        let wire = outcome.verdict.facts.iter().find(|f| f.id == "wire-mass");
        let wire = wire.and_then(|f| f.value.as_ref()).unwrap().value;
        (wire, check(&outcome.verdict, "lack").clone())
    };
    let (plain, lack) = told();
    assert!(!lack.reason.contains("stands"), "{lack:?}");
    let stands = cell(dialect).replace(from, to);
    assert_ne!(stands, cell(dialect));
    std::fs::write(home.join("cell.toml"), stands).unwrap();
    let (wire, lack) = told();
    ([plain, wire], lack)
}

/// Times that the arc's own words say are read back with the program: their metal is laid.
#[test]
fn a_plan_whose_arc_stands_by_its_own_words_lays_their_metal() {
    for (dialect, robot, change) in [
        (
            "kuka-krl",
            "kuka-kr16-r2010-2",
            [
                "job_mode = \"CMT\"",
                "job_mode = \"CMT\"\nstart_time = \"0.5 s\"",
            ],
        ),
        (
            "yaskawa-inform",
            "yaskawa-ar2010",
            [
                "zones = [",
                "arc_start = [\"ARCON AC={1} AVP={2} T=0.50\"]\nzones = [",
            ],
        ),
    ] {
        let ([plain, wire], lack) = standing(dialect, robot, change);
        assert!(!lack.reason.contains("stands"), "{lack:?}");
        // two layers of one bead: two starts of 0.5 s at 8 m/min and what the source feeds more at the distance of its tube
        // a metre of steel wire of 1 mm weighs 6.17 g
        let more = (wire - plain) / 6.17e-3;
        let fed = 2.0 * 0.5 * 8.0 / 60.0;
        assert!(
            more > 0.98 * fed && more < 1.25 * fed,
            "{dialect}: {more} m, {fed} m"
        );
    }
}

/// A wait among the lines that switch the arc may lay metal that no plan has: nothing of it is decided, and the times are told.
#[test]
fn a_plan_whose_arc_stands_is_in_doubt() {
    for (dialect, robot, from, to) in [
        (
            "ur-script",
            "universal-ur10e",
            "\"set_digital_out(0, True)\"]",
            "\"set_digital_out(0, True)\", \"sleep(0.5)\"]",
        ),
        (
            "staubli-val3",
            "staubli-rx60bl",
            "\"doArc=true\"]",
            "\"doArc=true\", \"delay(0.5)\"]",
        ),
    ] {
        let (_, found) = standing(dialect, robot, [from, to]);
        assert_eq!(found.status, Status::CannotSay, "{found:?}");
        let told = "stands 0.50 s where the arc starts and 0.00 s where it ends";
        assert!(found.reason.contains(told), "{found:?}");
    }
}

/// Of several dialects the one that cannot be written is named.
#[test]
fn the_dialect_that_cannot_be_written_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let home = dir.path();
    // the values of the schedule say another wire feed: FANUC's words call it by its number alone
    let cell = cell("fanuc-ls").replace("values = [4, 8]", "values = [4, 9]");
    std::fs::write(home.join("cell.toml"), cell).unwrap();
    let rest = "[output]\nprograms = [\"fanuc-ls\", \"kuka-krl\"]\n";
    let job = job(home, "cell = \"cell.toml\"", rest);
    let error = run(&job, NextIn(&home.join("runs")), &Silent).unwrap_err();
    let error = error.to_string();
    assert!(
        error.contains("programs for kuka-krl cannot be written"),
        "{error}"
    );
    assert!(error.contains("output.programs"), "{error}");
}

/// Two dialects lean on an arm of their maker: what is told of it before anything runs is what a run refuses.
#[test]
fn programs_that_need_a_robot_of_their_maker_are_refused_beforehand() {
    for (asked, robot, refused) in [
        (
            "\"kuka-krl\", \"yaskawa-inform\"",
            "kuka-kr16-r2010-2",
            "yaskawa-inform",
        ),
        (
            "\"kuka-krl\", \"ur-script\"",
            "kuka-kr16-r2010-2",
            "ur-script",
        ),
        (
            "\"yaskawa-inform\", \"ur-script\"",
            "universal-ur10e",
            "yaskawa-inform",
        ),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let home = dir.path();
        std::fs::write(home.join("cell.toml"), cell("kuka-krl")).unwrap();
        let machine = format!("cell = \"cell.toml\"\nrobot = \"{robot}\"");
        let job = job(home, &machine, &format!("[output]\nprograms = [{asked}]\n"));
        let ran = run(&job, NextIn(&home.join("runs")), &Silent).unwrap_err();
        let found = examine(&job, &Silent).unwrap_err();
        let told = found.to_string();
        assert_eq!(told, ran.to_string());
        let wanted = format!("programs for {refused} cannot be written");
        assert!(told.contains(&wanted), "{told}");
        assert!(
            told.contains("machine.robot") && told.contains("output.programs"),
            "{told}"
        );
    }
}

#[test]
fn programs_of_other_controllers_run_and_are_read_back() {
    for (dialect, robot, files) in [
        (
            "kuka-krl",
            "kuka-kr16-r2010-2",
            ["JOB.dat", "JOB.src"].as_slice(),
        ),
        ("abb-rapid", "abb-irb2600-12-185", &["JOB.mod"]),
        ("ur-script", "universal-ur10e", &["JOB.script"]),
        ("yaskawa-inform", "yaskawa-ar2010", &["JOB.JBI"]),
        (
            "staubli-val3",
            "staubli-rx60bl",
            &["JOB.dtx", "JOB.pjx", "start.pgx", "stop.pgx", "JOB.pgx"],
        ),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let (home, job) = job_for(dir.path(), dialect, robot);
        let outcome = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
        let mut wanted = files.to_vec();
        wanted.sort_unstable();
        assert_eq!(names(&outcome.folder), wanted, "{dialect}");
        let verdict = &outcome.verdict;
        assert_eq!(check(verdict, "program").status, Status::Pass, "{dialect}");
        // the robots that ship rest on guesses: they reach, and nothing is promised
        assert_eq!(
            check(verdict, "reach").status,
            Status::CannotSay,
            "{dialect}: {:?}",
            check(verdict, "reach")
        );
        if dialect != "ur-script" {
            assert_eq!(
                check(verdict, "config").status,
                Status::Pass,
                "{dialect}: {:?}",
                check(verdict, "config")
            );
        }
        for id in ["lack", "accumulation"] {
            let check = check(verdict, id);
            assert_eq!(check.status, Status::CannotSay, "{dialect}: {check:?}");
            assert!(check.reason.contains("no corner model"), "{check:?}");
        }
        let main = outcome.folder.join("program").join(files[files.len() - 1]);
        let again =
            simulate_program(&main, Some(&job), NextIn(&home.join("again")), &Silent).unwrap();
        assert_eq!(
            check(&again.verdict, "lines").status,
            Status::Pass,
            "{dialect}"
        );
        assert_eq!(
            check(&again.verdict, "lack").status,
            Status::CannotSay,
            "{dialect}"
        );
        // the same metal, on a map that lies elsewhere
        let built = |v: &Verdict| {
            let fact = v.facts.iter().find(|f| f.id == "height-built").unwrap();
            fact.value.as_ref().unwrap().value
        };
        let off = (built(&again.verdict) - built(verdict)).abs();
        assert!(off < 0.01, "{dialect}: {off} mm");
    }
}

/// Part and wire tip that the program has elsewhere than the robot's file: the arm that was checked is not the one that moves.
#[test]
fn an_arm_that_was_checked_elsewhere_is_not_decided_about() {
    for (dialect, robot, main, from, to, told) in [
        (
            "staubli-val3",
            "staubli-rx60bl",
            "JOB.pgx",
            "part_position = [\"500 mm\"",
            "part_position = [\"400 mm\"",
            "the part is at x, y, z 400, 0, 0 mm, rx, ry, rz 0, 0, 0 deg in the arm's base, by the robot's file at x, y, z 500, 0, 0 mm",
        ),
        (
            "staubli-val3",
            "staubli-rx60bl",
            "JOB.pgx",
            "tool_angles = [\"0 deg\", \"35 deg\"",
            "tool_angles = [\"0 deg\", \"36 deg\"",
            "0.0 mm and 1.00 deg apart",
        ),
        (
            "ur-script",
            "universal-ur10e",
            "JOB.script",
            "part = \"Part\"",
            "part = \"p[0.5, 0.1, 0.2, 0, 0, 0]\"",
            "the part is at p[0.5, 0.1, 0.2, 0, 0, 0] in the arm's base",
        ),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let (home, job) = job_for(dir.path(), dialect, robot);
        let text = cell(dialect);
        assert!(text.contains(from));
        std::fs::write(home.join("cell.toml"), text.replace(from, to)).unwrap();
        let outcome = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
        let file = outcome.folder.join("program").join(main);
        let again =
            simulate_program(&file, Some(&job), NextIn(&home.join("again")), &Silent).unwrap();
        for verdict in [&outcome.verdict, &again.verdict] {
            let reach = check(verdict, "reach");
            says(&reach.reason, &["the arm was checked elsewhere", told]);
            let config = check(verdict, "config");
            let undecided = match dialect {
                // has no words for how an arm stands
                "ur-script" => Status::NotChecked,
                _ => Status::CannotSay,
            };
            assert_eq!(
                (reach.status, config.status),
                (Status::CannotSay, undecided)
            );
            says(reach.remedy.as_ref().unwrap(), &["of the robot's file"]);
        }
    }
}

/// Of several programs the one that the arm's maker reads is judged, whichever comes first; what another tells elsewhere than the robot's file
/// leaves the arm open, too, and of a program that the arm's maker does not read nothing is decided.
#[test]
fn of_programs_for_several_controllers_none_is_passed_over() {
    let elsewhere = "the arm was checked elsewhere";
    let own = "maker = \"staubli\"";
    for (maker, programs, told) in [
        (own, "\"fanuc-ls\", \"staubli-val3\"", elsewhere),
        (
            "",
            "\"fanuc-ls\", \"staubli-val3\"",
            "of the program for Stäubli VAL3: the arm was checked elsewhere",
        ),
        (
            own,
            "\"fanuc-ls\"",
            "the arm that is named is another maker's",
        ),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let home = dir.path().join("job");
        std::fs::create_dir(&home).unwrap();
        let cell = cell("fanuc-ls")
            .replace("dialect = \"fanuc-ls\"\n", "")
            .replace("part_position = [\"500 mm\"", "part_position = [\"400 mm\"");
        std::fs::write(home.join("cell.toml"), cell).unwrap();
        let robot = find(robots::ALL, "staubli-rx60bl").unwrap().text;
        let robot = robot.replace("maker = \"staubli\"", maker);
        std::fs::write(home.join("robot.toml"), robot).unwrap();
        let machine = "cell = \"cell.toml\"\nrobot = \"robot.toml\"";
        let rest = format!("[output]\nprograms = [{programs}]\n");
        let outcome = run(
            &job(&home, machine, &rest),
            NextIn(&home.join("runs")),
            &Silent,
        );
        let verdict = outcome.unwrap().verdict;
        for id in ["reach", "collision"] {
            let check = check(&verdict, id);
            assert_eq!(check.status, Status::CannotSay, "{programs}: {check:?}");
            says(&check.reason, &[told]);
        }
    }
}

/// The corner model of one controller says nothing of another's program.
#[test]
fn one_job_is_written_for_two_controllers() {
    let dir = tempfile::tempdir().unwrap();
    // programs are called after the folder
    let home = dir.path().join("job");
    std::fs::create_dir(&home).unwrap();
    let mut text = cells::ARCMATE_120IC.text.replace(
        "[program]",
        "[program]\nblend = \"2 mm\"\narc_values = [\"schedule\", \"wire feed, m/min\"]",
    );
    let (_, words) = cell("kuka-krl")
        .split_once("[[program.schedule]]")
        .map(|(a, b)| (a.to_owned(), b.to_owned()))
        .unwrap();
    write!(text, "[[program.schedule]]{words}").unwrap();
    std::fs::write(home.join("cell.toml"), text).unwrap();
    let job = job(
        &home,
        "cell = \"cell.toml\"",
        "[output]\nprograms = [\"fanuc-ls\", \"kuka-krl\"]\n",
    );
    let outcome = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
    assert_eq!(names(&outcome.folder), ["JOB.LS", "JOB.dat", "JOB.src"]);
    assert_eq!(check(&outcome.verdict, "program").status, Status::Pass);
    // two layers of a wall of ten
    let lack = check(&outcome.verdict, "lack");
    assert_eq!(lack.status, Status::Fail);
    says(
        lack.remedy.as_ref().unwrap(),
        &["raise layers.count", "2 layers end"],
    );
    // nor does more metal over the top mend what was not laid
    let stock = check(&outcome.verdict, "stock");
    says(
        stock.remedy.as_ref().unwrap(),
        &["raise layers.count", "2 layers end"],
    );
    let main = outcome.folder.join("program/JOB.src");
    let again = simulate_program(&main, Some(&job), NextIn(&home.join("again")), &Silent).unwrap();
    let lack = check(&again.verdict, "lack");
    assert_eq!(lack.status, Status::CannotSay);
    assert!(lack.reason.contains("written in KUKA KRL"), "{lack:?}");
}

#[test]
fn a_cell_without_words_is_told_what_to_write() {
    let dir = tempfile::tempdir().unwrap();
    // programs are called after the folder
    let home = dir.path().join("job");
    std::fs::create_dir(&home).unwrap();
    let job = job(&home, "", "[output]\nprograms = [\"abb-rapid\"]\n");
    let told = run(&job, NextIn(&home.join("runs")), &Silent)
        .unwrap_err()
        .to_string();
    assert!(told.contains("write program.rapid"), "{told}");
}

#[test]
fn the_rest_of_a_plan_and_its_dry_run_are_written() {
    for (dialect, robot, ending) in [
        ("fanuc-ls", "fanuc-arcmate-120ic", "LS"),
        ("ur-script", "universal-ur10e", "script"),
        ("yaskawa-inform", "yaskawa-ar2010", "JBI"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let (home, job) = job_for(dir.path(), dialect, robot);
        let plan = home.join("plan.melt");
        plan_to_file(&job, &plan, LeftOpen::Chosen, &Silent).unwrap();
        let written = |from, torch, name: &str| {
            let out = home.join(name);
            let wanted = Wanted { from, torch };
            let files = program_to_folder(&job, &plan, &out, wanted, (&Reporter::new(), &Silent));
            files.map(|written| {
                let files = written.files;
                (
                    files.clone(),
                    std::fs::read_to_string(out.join(&files[0])).unwrap(),
                )
            })
        };
        let rest = Restart { layer: 2, bead: 1 };
        let (files, text) = written(Some(rest), Torch::Burns, "rest").unwrap();
        assert_eq!(files, [format!("JOB_R2B1.{ending}")]);
        assert!(
            text.contains("Layer 2") && !text.contains("Layer 1"),
            "{text}"
        );
        let (files, text) = written(None, Torch::Dry, "dry").unwrap();
        assert_eq!(files, [format!("JOB_DRY.{ending}")]);
        for word in ["Arc Start", "set_digital_out", "ARCON"] {
            assert!(!text.contains(word), "{text}");
        }
        let nowhere = Restart { layer: 9, bead: 1 };
        let refused = written(Some(nowhere), Torch::Burns, "none").unwrap_err();
        assert!(refused.to_string().contains("layers 1 to 2"), "{refused}");
        assert!(!home.join("none").exists());
    }
}

/// A project of a Stäubli in inches is refused: its points would be read 25.4 times too small.
#[test]
fn a_project_in_inches_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let (home, job) = job_for(dir.path(), "staubli-val3", "staubli-rx60bl");
    let run = run(&job, NextIn(&home.join("runs")), &Silent).unwrap();
    let program = run.folder.join("program");
    let project = program.join("JOB.pjx");
    let text = std::fs::read_to_string(&project).unwrap();
    let text = text.replace("millimeterUnit=\"true\"", "millimeterUnit=\"false\"");
    std::fs::write(&project, text).unwrap();
    let runs = home.join("of-programs");
    let refused = simulate_program(&program.join("JOB.pgx"), Some(&job), NextIn(&runs), &Silent);
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("in inches"), "{refused}");
    assert!(refused.contains("millimetres"), "{refused}");
}
