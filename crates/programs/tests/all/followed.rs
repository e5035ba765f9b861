//! What is followed of programs for other controllers than FANUC's: routines with arguments and truths of an ABB, variables and jumps of a Yaskawa,
//! how fast a KUKA turns the tool.

use meltpath_base::Reporter;
use meltpath_programs::{
    ExecutionSettings, Gap, Missing, ParseError, Program, Reading, Refusal, inform, krl, rapid,
};

use crate::told::{motions, read};

fn run(programs: &[Program], known: &ExecutionSettings) -> Reading {
    read(programs, known, &Reporter::new()).unwrap()
}

fn ends(reading: &Reading) -> Vec<[f64; 3]> {
    motions(reading).iter().map(|m| m.to.to_array()).collect()
}

fn texts(gaps: &[Gap]) -> Vec<&str> {
    gaps.iter().map(|g| g.text.as_str()).collect()
}

const ABB: &str = "MODULE W
  CONST robtarget p1:=[[0,0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[80,0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  LOCAL PERS bool bUsed:=TRUE;
  PERS bool bOften:=FALSE;
  VAR bool bSet:=FALSE;
";

fn of_abb(body: &str, more: &str, known: &ExecutionSettings) -> Reading {
    let text = format!(
        "{ABB}  PROC main()\n MoveL p1,v100,fine,tool0;\n{body}\n  ENDPROC\n{more}\nENDMODULE\n"
    );
    let parsed = rapid::read(text.as_bytes(), 1).unwrap();
    let programs: Vec<Program> = parsed.into_iter().map(|p| p.program).collect();
    run(&programs, known)
}

fn plain(body: &str, more: &str) -> (Vec<f64>, Vec<String>) {
    let reading = of_abb(body, more, &ExecutionSettings::default());
    let gaps = reading.gaps.iter().map(|g| g.text.clone()).collect();
    (ends(&reading).iter().map(|e| e[0]).collect(), gaps)
}

#[test]
fn routines_of_an_abb_run_with_their_arguments() {
    let seam = "PROC Seam(num x, robtarget p, speeddata v)
        IF x>5 THEN
          MoveL Offs(p,x,0,0),v,fine,tool0;
        ELSE
          Seam x+3,p,v;
        ENDIF
      ENDPROC";
    let (places, gaps) = plain("Seam 6,p2,v100; Seam 1,p1,v50; Seam 6,p2,v100;", seam);
    assert_eq!(gaps, [] as [&str; 0]);
    assert_eq!(places, [86.0, 7.0, 86.0]);
    // what it may set, what may be missing, and what is not known, is told
    for (call, head) in [
        ("Seam 6;", "PROC Seam(INOUT num x)"),
        ("Seam 6;", "PROC Seam(num x\\num y)"),
        ("Seam 6,7;", "PROC Seam(num x)"),
        ("Seam \\On,7;", "PROC Seam(num x)"),
    ] {
        let (places, gaps) = plain(
            call,
            &format!("{head}\n MoveL Offs(p1,x,0,0),v100,fine,tool0;\nENDPROC"),
        );
        assert_eq!((places.len(), gaps.len()), (0, 1), "{call} {head}");
    }
    // one that calls itself for ever is refused
    let text = format!(
        "{ABB}PROC main()\n Seam 1;\nENDPROC\nPROC Seam(num x)\n Seam x+1;\nENDPROC\nENDMODULE\n"
    );
    let parsed = rapid::read(text.as_bytes(), 1).unwrap();
    let programs: Vec<Program> = parsed.into_iter().map(|p| p.program).collect();
    let known = ExecutionSettings::default();
    let refused = read(&programs, &known, &Reporter::new()).unwrap_err();
    assert!(matches!(refused.why, Refusal::Loop(_)), "{refused}");
}

#[test]
fn truths_of_an_abb_decide() {
    let found = |condition: &str| {
        let body = format!("IF {condition} THEN\n MoveL p2,v100,fine,tool0;\nENDIF");
        let set = "PROC Other()\n bSet:=TRUE;\nENDPROC";
        let (places, gaps) = plain(&body, set);
        (places.len(), gaps.len())
    };
    assert_eq!(found("bUsed"), (1, 0));
    assert_eq!(found("NOT bUsed"), (0, 0));
    assert_eq!(found("bOften=FALSE AND bUsed"), (1, 0));
    assert_eq!(found("bOften"), (0, 0));
    // one that a line sets is not known
    assert_eq!(found("bSet").1, 2);
    let (places, gaps) = plain(
        "VAR bool b;\n b:=bUsed;\n IF b=TRUE THEN\n MoveL p2,v100,fine,tool0;\nENDIF",
        "",
    );
    assert_eq!((places.len(), gaps), (1, vec![]));
}

#[test]
fn data_of_other_kinds_stop_no_program_of_an_abb() {
    let (_, gaps) = plain(
        "VAR iodev log;\n VAR string s:=\"a(b)\";\n bSet:=TRUE;\n s:=\"x\";\n VAR clock c;",
        "",
    );
    assert_eq!(gaps, [] as [&str; 0]);
    let (_, gaps) = plain(
        "bSet:=Asked(1);\n VAR tooldata t;\n VAR string s:=Name(2);",
        "",
    );
    assert_eq!(gaps.len(), 3);
    // what lays no metal is named by the cell, whatever its arguments are
    let mut known = ExecutionSettings::default();
    let body = "Logging \"start\";\n MoveL p2,v100,fine,tool0;";
    assert_eq!(texts(&of_abb(body, "", &known).gaps), ["Logging \"start\""]);
    known.passed_over.insert("LOGGING".to_owned());
    let reading = of_abb(body, "", &known);
    assert_eq!((reading.gaps.len(), ends(&reading).len()), (0, 1));
}

#[test]
fn outputs_of_an_abb_that_the_cell_tells_shape_no_metal() {
    let body = "SetGO Go80,0;\n SetGO \\SDelay:=0.2,Go81,3;";
    let mut known = ExecutionSettings::default();
    assert_eq!(of_abb(body, "", &known).gaps.len(), 2);
    for name in ["GO80", "GO81"] {
        known.outputs.push(meltpath_programs::ToldOutput {
            name: name.to_owned(),
            number: None,
            value: None,
            schedule: None,
        });
    }
    assert_eq!(of_abb(body, "", &known).gaps, []);
}

fn job(lines: &str, variables: &[(&str, u32, f64)]) -> (Vec<f64>, Vec<Missing>) {
    let head = "/JOB\n//NAME A\n//POS\n///NPOS 4,0,0,0,0,0\n///USER 3\n///TOOL 2\n///POSTYPE USER\n///RECTAN\n///RCONF 1,0,0,0,0,0,0,0\n";
    let place = |i: u32| format!("C0000{i}={i}.000,0.000,0.000,180.0000,0.0000,0.0000\n");
    let line = |line: &str| match line.parse::<u32>() {
        Ok(place) => format!("MOVL C0000{place} V=6.0 PL=0\n"),
        Err(_) => format!("{line}\n"),
    };
    let places: String = (0..4).map(place).collect();
    let body: String = lines.split(" | ").map(line).collect();
    let text = format!("{head}{places}//INST\nNOP\nMOVL C00000 V=6.0 PL=0\n{body}END\n");
    let parsed = inform::read(text.as_bytes(), None, &inform::Pulses::default()).unwrap();
    let told = variables
        .iter()
        .map(|(name, number, value)| (((*name).to_owned(), *number), *value));
    let known = ExecutionSettings {
        variables: told.collect(),
        ..ExecutionSettings::default()
    };
    let reading = run(&[parsed[0].program.clone()], &known);
    let gaps = reading.gaps.iter().map(|g| g.why.clone()).collect();
    (ends(&reading).iter().map(|e| e[0]).collect(), gaps)
}

#[test]
fn jobs_of_a_yaskawa_count_and_jump() {
    let choice = "JUMP LABEL: B099 | *0 | 1 | JUMP *LABEL | *1 | 2 | JUMP *LABEL | *LABEL | 3";
    for (lines, told, places) in [
        (
            "SET B001 2 | ADD B001 1 | JUMP *A IF B001=3 | 1 | *A | 2",
            None,
            &[2.0][..],
        ),
        (
            "SET LB000 2 | SUB LB0 1 | JUMP *A IF LB000<>1 | 1 | *A | 2",
            None,
            &[1.0, 2.0],
        ),
        (
            "SET I000 0 | *A | 1 | INC I000 | JUMP *A IF I000<3",
            None,
            &[1.0, 1.0, 1.0],
        ),
        (
            "SET D001 EXPRESS 2 * ( 3 - 1 ) | DIV D001 2 | MUL D001 4 | DEC D001 | JUMP *A IF D001=7 | 1 | *A",
            None,
            &[],
        ),
        (
            "CLEAR B010 2 | JUMP *A IF B011=0 | 1 | *A | SFTOF | 2",
            None,
            &[2.0],
        ),
        ("SET B001 1 | RET IF B001=1 | 1", None, &[]),
        (choice, Some(("B", 99, 1.0)), &[2.0, 3.0]),
        (choice, Some(("B", 99, 0.0)), &[1.0, 3.0]),
    ] {
        let told: Vec<_> = told.into_iter().collect();
        assert_eq!(job(lines, &told), (places.to_vec(), vec![]), "{lines}");
    }
}

#[test]
fn what_hangs_on_unknown_variables_of_a_yaskawa_is_told() {
    for lines in [
        "GETARG LB000 IARG#(1) | JUMP *A IF LB000=1 | *A",
        // none of these fits its variable
        "SET B001 300 | JUMP *A IF B001=44 | *A",
        "SET I001 7 | DIV I001 2 | JUMP *A IF I001=3 | *A",
        "JUMP LABEL: B099 | *0",
        "JUMP *NOWHERE",
        "CALL JOB:OTHER IF B001=1",
    ] {
        let (_, gaps) = job(lines, &[]);
        assert!(matches!(gaps[..], [Missing::Jump(_)]), "{lines}: {gaps:?}");
    }
    // an unknown line may set what all jobs see
    let (_, gaps) = job(
        "SET B001 1 | MACRO1 MJ#(0) ARGF10 | JUMP *A IF B001=1 | *A",
        &[],
    );
    assert_eq!(gaps.len(), 2);
    // places are not reckoned with
    let (_, gaps) = job("SET P001 P002", &[]);
    assert!(matches!(gaps[..], [Missing::Unknown(_)]));
    // where a jump was passed over none leads back
    let (places, gaps) = job("*B | 1 | JUMP *C IF B000=1 | JUMP *B | *C | 2", &[]);
    assert_eq!((places, gaps.len()), (vec![1.0, 2.0], 2));
}

fn of_kuka(lines: &str) -> Reading {
    let text = format!(
        "DEF A( )\n$BASE=BASE_DATA[1]\n$TOOL=TOOL_DATA[1]\n$VEL.CP=0.01\nLIN {{X 0,Y 0,Z 0,A 0,B 0,C 180}}\n{lines}\nLIN {{X 10,Y 0,Z 0,A 0,B 0,C 90}}\nEND\n"
    );
    let parsed = krl::read(text.as_bytes(), None, 1, None).unwrap();
    run(&[parsed[0].program.clone()], &ExecutionSettings::default())
}

#[test]
fn a_kuka_turns_the_tool_as_fast_as_its_lines_say() {
    let speed = |lines: &str| {
        let reading = of_kuka(lines);
        let gaps = reading.gaps.len();
        (motions(&reading)[0].speed.unwrap(), gaps)
    };
    assert_eq!(
        speed("$VEL.ORI1=200\n$VEL.ORI2=200\n$ACC.ORI1=500\n$ACC.ORI2=500"),
        (10.0, 0)
    );
    // 90° at 45 °/s take two seconds
    let (slow, gaps) = speed("$VEL.ORI1 = 45");
    assert!((slow - 5.0).abs() < 1e-9 && gaps == 0, "{slow}");
    assert_eq!(speed("$VEL.ORI1=VSLOW"), (10.0, 1));
}

#[test]
fn a_kuka_program_whose_name_is_none_is_refused_by_it() {
    let refused = krl::read(b"&ACCESS RVP\nDEF 10l_cln( )\nEND\n", None, 1, None).unwrap_err();
    let name = "10l_cln".to_owned();
    assert_eq!(refused, ParseError::Name { line: 2, name });
    assert!(refused.to_string().contains("10l_cln"));
}
