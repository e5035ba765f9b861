//! Conditions, choices, loops and calls: followed as the controller follows them where the values that decide are known.

use std::collections::BTreeMap;

use meltpath_base::Reporter;
use meltpath_programs::{ExecutionSettings, Missing, Refusal};

use crate::told::{execute, motions, program, read};

/// The x of each place that a program goes to after its first: 1, 2 or 3.
fn places(lines: &[&str]) -> Result<Vec<u32>, Refusal> {
    let all = [&[ONE], lines].concat();
    let reading = execute(&[program("P", &all)])?;
    Ok(motions(&reading).iter().map(|m| m.to.x as u32).collect())
}

const ONE: &str = "L P[1] 50mm/sec FINE";
const TWO: &str = "L P[2] 50mm/sec FINE";
const THREE: &str = "L P[3] 50mm/sec FINE";

/// Cases of lines, with `|` between, and the points that they lead to; none where a condition is not known. `1`, `2` and `3` go to the
/// point of that number, `go N` to P[N].
fn follow(cases: &[(&str, &[u32])]) {
    for (text, expected) in cases {
        let lines: Vec<String> = text
            .split(" | ")
            .map(|line| match (line, line.strip_prefix("go ")) {
                ("1" | "2" | "3", _) => format!("L P[{line}] 50mm/sec FINE"),
                (_, Some(place)) => format!("L P[{place}] 50mm/sec FINE"),
                _ => line.to_owned(),
            })
            .collect();
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        let found = places(&lines);
        if expected.is_empty() {
            let unknown = matches!(found, Err(Refusal::Condition(_)));
            assert!(unknown, "{text}: {found:?}");
        } else {
            assert_eq!(found.as_deref(), Ok(*expected), "{text}");
        }
    }
}

#[test]
fn conditions_are_followed_where_their_values_are_known() {
    let otherwise = "IF (R[1]=2) THEN | 2 | ELSE | 3 | ENDIF | 1";
    follow(&[
        ("R[1]=3 | IF R[1]>2,JMP LBL[1] | 2 | LBL[1] | 3", &[3]),
        ("R[1]=2 | IF (R[1]>2),JMP LBL[1] | 2 | LBL[1] | 3", &[2, 3]),
        (&format!("R[1]=2 | {otherwise}"), &[2, 1]),
        (&format!("R[1]=1 | {otherwise}"), &[3, 1]),
        (
            "R[1]=1 | IF (R[1]=2) THEN | IF (DI[1]) THEN | 2 | ELSE | ENDIF | ENDIF | 1",
            &[1],
        ),
        ("DO[4]=ON | IF DO[4]=OFF,JMP LBL[1] | 2 | LBL[1]", &[2]),
        ("F[1]=(ON) | IF (F[1] AND !DO[1]) THEN | 2 | ENDIF | 1", &[]),
    ]);
}

#[test]
fn choices_and_registers_lead_on() {
    let choice = "SELECT R[1]=1,JMP LBL[1] | =2,JMP LBL[2] | ELSE,JMP LBL[3] | LBL[1] | 1 | LBL[2] | 2 | LBL[3] | 3";
    follow(&[
        (&format!("R[1]=2 | {choice}"), &[2, 3]),
        (&format!("R[1]=7 | {choice}"), &[3]),
        (
            "R[1]=7 | SELECT R[1]=1,JMP LBL[1] | 2 | LBL[1] | 1",
            &[2, 1],
        ),
        ("R[2]=3 | go R[2] | R[2]=R[2]-1 | go R[2]:x", &[3, 2]),
        ("R[5]=2 | JMP LBL[R[5]] | LBL[1] | 1 | LBL[2] | 2", &[2]),
    ]);
}

#[test]
fn loops_run_as_often_as_they_say() {
    follow(&[
        ("FOR R[1]=1 TO 3 | go R[1] | ENDFOR", &[1, 2, 3]),
        ("FOR R[1:GO TOP]=3 DOWNTO 2 | go R[1] | ENDFOR", &[3, 2]),
        ("FOR R[1]=2 TO 1 | 2 | ENDFOR | 1", &[1]),
        (
            "FOR R[1]=1 TO 2 | FOR R[2]=1 TO R[1] | go R[2] | ENDFOR | 3 | ENDFOR",
            &[1, 3, 1, 2, 3],
        ),
        (
            "R[1]=1 | LBL[1] | go R[1] | R[1]=R[1]+1 | IF R[1]<=3,JMP LBL[1]",
            &[1, 2, 3],
        ),
        (
            "R[1]=3 | WHILE (R[1]>1) | go R[1] | R[1]=R[1]-1 | ENDWHILE | 1",
            &[3, 2, 1],
        ),
    ]);
}

#[test]
fn what_does_not_end_is_refused() {
    for lines in [
        &["LBL[1]", TWO, "JMP LBL[1]"] as &[&str],
        // counts for ever
        &["R[1]=0", "LBL[1]", "R[1]=R[1]+1", "JMP LBL[1]"],
        &["CALL P"],
        &["WHILE (1=1)", TWO, "ENDWHILE"],
    ] {
        let found = places(lines);
        assert!(
            matches!(found, Err(Refusal::Loop(_))),
            "{lines:?}: {found:?}"
        );
    }
    // calls that double at every depth
    let chain: Vec<_> = (0..40)
        .map(|k| {
            let next = format!("CALL P{}", k + 1);
            program(&format!("P{k}"), &[next.as_str(), next.as_str()])
        })
        .chain([program("P40", &[ONE])])
        .collect();
    assert!(matches!(execute(&chain), Err(Refusal::Loop(_))));
}

#[test]
fn calls_are_followed_to_any_depth_with_their_arguments() {
    let chain: Vec<_> = (0..30)
        .map(|k| {
            let next = format!("CALL P{}(AR[1]+1)", k + 1);
            program(
                &format!("P{k}"),
                &[if k == 0 { "CALL P1(0)" } else { &next }],
            )
        })
        .chain([program(
            "P30",
            &[
                "R[1]=AR[1]",
                "IF R[1]=29,JMP LBL[1]",
                "END",
                "LBL[1]",
                ONE,
                TWO,
            ],
        )])
        .collect();
    let reading = execute(&chain).unwrap();
    let moves = motions(&reading);
    assert_eq!((moves.len(), moves[0].control.program), (1, 30));
}

#[test]
fn values_that_the_cell_gives_decide() {
    let settings = ExecutionSettings {
        registers: BTreeMap::from([(3, 20.0)]),
        signals: BTreeMap::from([(("DI".to_owned(), 2), true)]),
        ..ExecutionSettings::default()
    };
    let lines = [
        ONE,
        "WAIT DI[2]=ON",
        "IF DI[2]=ON,JMP LBL[1]",
        THREE,
        "LBL[1]",
        "L P[2] R[3]mm/sec FINE",
        "WAIT R[3]",
    ];
    let reading = read(&[program("P", &lines)], &settings, &Reporter::new()).unwrap();
    let moves = motions(&reading);
    assert_eq!(
        (moves.len(), moves[0].to.x, moves[0].speed),
        (1, 2.0, Some(20.0))
    );
    assert_eq!(reading.controls.len(), 2);
    // what nobody knows is not guessed
    assert!(matches!(
        execute(&[program("P", &lines)]),
        Err(Refusal::Condition(_))
    ));
    // a value that is lost is not kept
    let lost = ["R[3]=GI[1]", ONE, "L P[R[3]] 10mm/sec FINE"];
    let reading = read(&[program("P", &lost)], &settings, &Reporter::new()).unwrap();
    assert_eq!(reading.gaps.len(), 1);
}

#[test]
fn position_registers_are_known_as_far_as_the_program_sets_them() {
    let at = |lines: &[&str]| {
        let all: Vec<_> = [ONE].iter().chain(lines).copied().collect();
        let reading = execute(&[program("P", &all)]).unwrap();
        let places: Vec<_> = motions(&reading).iter().map(|m| (m.to.x, m.to.z)).collect();
        (places, reading.gaps.len())
    };
    let go = "L PR[7] 50mm/sec FINE";
    for (lines, place) in [
        (&["PR[7]=P[2]", go] as &[&str], Some((2.0, 0.0))),
        (&["PR[7]=P[2]", "PR[7,3]=PR[7,3]+1.5", go], Some((2.0, 1.5))),
        (
            &["PR[7]=LPOS", "R[1]=40", "PR[7,3:up]=R[1]", go],
            Some((1.0, 40.0)),
        ),
        (
            &["PR[1]=P[2]", "PR[2]=P[3]", "PR[7]=PR[2]-PR[1]+PR[2]", go],
            Some((4.0, 0.0)),
        ),
        (&["PR[7]=JPOS", go], None),
        (&["PR[7,3]=5", go], None),
        (&["PR[7]=P[4]", go], None),
    ] {
        let (places, gaps) = at(lines);
        assert_eq!(places, place.into_iter().collect::<Vec<_>>(), "{lines:?}");
        assert_eq!(gaps, usize::from(place.is_none()), "{lines:?}");
    }
    // a layer repeated higher and higher
    let zero = ["PR[5]=P[1]", "PR[5]=PR[5]-PR[5]"];
    let up = [
        "FOR R[1]=1 TO 3",
        "L P[2] 9mm/sec FINE Offset,PR[5:up]",
        "PR[5,3]=PR[5,3]+1.7",
        "ENDFOR",
    ];
    let lines: Vec<_> = zero.iter().chain(&up).copied().collect();
    let (places, gaps) = at(&lines);
    assert_eq!((places.len(), gaps), (3, 0));
    for (k, (x, z)) in places.iter().enumerate() {
        assert!((x - 2.0).abs() < 1e-12 && (z - 1.7 * k as f64).abs() < 1e-12);
    }
    // an offset that turns the tool, and one that is not known
    for set in ["PR[5,6]=90", "PR[5]=PR[9]"] {
        let lines = [zero[0], zero[1], set, "L P[2] 9mm/sec FINE Offset,PR[5]"];
        assert_eq!(at(&lines), (vec![], 1), "{set}");
    }
}

/// What an arc without its other end leaves open is told; the beads whose moves are there are laid, and end with the program.
#[test]
fn an_arc_without_its_other_end_is_told() {
    let laid = |lines: &[&str]| {
        let head = [
            "UFRAME_NUM=1",
            "UTOOL_NUM=1",
            "!Schedule 1 WFS 8 m/min",
            ONE,
        ];
        let reading = execute(&[program("P", &[&head, lines].concat())]).unwrap();
        let burns: Vec<_> = motions(&reading).iter().map(|m| m.burns).collect();
        let gaps: Vec<_> = reading.gaps.into_iter().map(|g| (g.line, g.why)).collect();
        (burns, gaps)
    };
    let on = "Arc Start[1]";
    let left = laid(&[on, TWO, THREE]);
    assert_eq!(left, (vec![true, true], vec![(7, Missing::ArcLeftOn)]));
    let twice = laid(&["Arc End[1]", on, TWO, "Arc End[1]", THREE]);
    assert_eq!(twice, (vec![true, false], vec![(5, Missing::ArcOff)]));
    let whole = laid(&[on, TWO, "Arc End[1]", THREE]);
    assert_eq!(whole, (vec![true, false], vec![]));
}
