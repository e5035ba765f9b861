//! Programs of other dialects that count: they come to what the same program says that is written out.
use meltpath_programs::program::{Coordinates, Instruction, PositionRef};
use meltpath_programs::{Parsed, krl, rapid, ur_script};

/// Where the moves of a program go, rounded to 1 nm, with their speeds; waits; and its lines that were not read.
fn moves(parsed: &Parsed) -> (Vec<String>, Vec<String>) {
    let place = |target: &PositionRef| match target {
        PositionRef::Unresolved(text) => format!("unresolved {text}"),
        PositionRef::Point { index, .. } => {
            let found = parsed.program.positions.iter().find(|p| p.index == *index);
            match found.map(|p| &p.groups[0].coordinates) {
                Some(Coordinates::Cartesian {
                    xyz, wpr_degrees, ..
                }) => {
                    let [x, y, z] = xyz.map(|v| format!("{v:.6}"));
                    let [w, p, r] = wpr_degrees.map(|v| format!("{:.6}", v + 0.0));
                    format!("{x} {y} {z} {w} {p} {r}").replace("-0.000000", "0.000000")
                }
                other => format!("{other:?}"),
            }
        }
    };
    let all = parsed.program.instructions.iter().filter_map(|i| match i {
        Instruction::Motion(m) => Some(format!(
            "{} {:?} {:?}",
            place(&m.target),
            m.speed,
            m.termination
        )),
        Instruction::Wait(s) => Some(format!("wait {s}")),
        Instruction::Call { program, .. } => Some(format!("call {program}")),
        _ => None,
    });
    (
        all.collect(),
        parsed.unread.iter().map(|u| u.text.clone()).collect(),
    )
}

const RAPID: &str = "MODULE W
  CONST robtarget p1:=[[0,0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST num dz:=2.2;
  PERS num layers:=2;
  VAR num set:=4;
  VAR robtarget p2;
";

fn of_abb(body: &str) -> (Vec<String>, Vec<String>) {
    let text = format!(
        "{RAPID}  PROC main()\n{body}\n  ENDPROC\n  PROC Foo()\n    set:=5;\n  ENDPROC\nENDMODULE\n"
    );
    moves(&rapid::read(text.as_bytes(), 1).unwrap()[0])
}

#[test]
fn loops_of_an_abb_come_to_what_they_count() {
    let counted = of_abb(
        "VAR num h;
         VAR num i:=0;
         p2:=Offs(p1,80,0,1);
         FOR k FROM 1 TO layers DO
           MoveL Offs(p1,0,0,(k-1)*dz+h),v100,fine,tool0;
           IF k MOD 2 = 1 THEN MoveL p1,v50,fine,tool0; ENDIF
         ENDFOR
         WHILE i<5 DO
           IF i=1 THEN
             MoveL p2,v10,z1,tool0;
           ELSEIF i>2 AND NOT i=3 THEN
             WaitTime i/2;
           ELSE
             MoveL p1,v100,fine,tool0;
           ENDIF
           p2.trans.z:=p2.trans.z+dz;
           Incr i;
         ENDWHILE
         FOR k FROM 4 TO 1 STEP -3 DO
           MoveL Offs(p2,k,0,0),v100,fine,tool0;
         ENDFOR"
            .replace(
                "IF k MOD 2 = 1 THEN MoveL p1,v50,fine,tool0; ENDIF\n",
                "IF k MOD 2 = 1 THEN\nMoveL p1,v50,fine,tool0;\nENDIF\n",
            )
            .as_str(),
    );
    let line = |x: f64, z: f64, v: f64, end: &str| {
        format!(
            "MoveL [[{x},0,{z}],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v{v},{end},tool0;"
        )
    };
    let written = [
        line(0.0, 0.0, 100.0, "fine"),
        line(0.0, 0.0, 50.0, "fine"),
        line(0.0, 2.2, 100.0, "fine"),
        line(0.0, 0.0, 100.0, "fine"),
        line(80.0, 3.2, 10.0, "z1"),
        line(0.0, 0.0, 100.0, "fine"),
        line(0.0, 0.0, 100.0, "fine"),
        "WaitTime 2;".to_owned(),
        line(84.0, 12.0, 100.0, "fine"),
        line(81.0, 12.0, 100.0, "fine"),
    ];
    assert_eq!(counted, of_abb(&written.join("\n")));
    assert_eq!(counted.1, [""; 0]);
}

/// Whatever a call may set, an input decides, or no line says, is not taken for what it was.
#[test]
fn what_is_not_known_of_an_abb_stays_told() {
    let (found, told) = of_abb(
        "VAR num own:=1;
         set:=3;
         MoveL Offs(p1,0,0,set),v100,fine,tool0;
         p2:=Offs(p1,1,0,0);
         Foo;
         MoveL Offs(p1,0,0,set),v100,fine,tool0;
         MoveL p2,v100,fine,tool0;
         MoveL Offs(p1,0,0,own),v100,fine,tool0;
         own:=Asked();
         MoveL Offs(p1,0,0,own),v100,fine,tool0;",
    );
    assert!(found[0].contains("3.000000"), "{found:?}");
    assert_eq!(found[1], "call Foo");
    assert!(
        found[2].starts_with("unresolved Offs(p1,0,0,set)"),
        "{found:?}"
    );
    assert!(found[3].starts_with("unresolved p2?"), "{found:?}");
    assert!(found[4].contains("1.000000"), "{found:?}");
    assert!(found[5].starts_with("unresolved"), "{found:?}");
    assert_eq!(told, ["own:=Asked()"]);
    for (open, end) in [
        ("FOR i FROM 1 TO DInput(di1) DO", "ENDFOR"),
        ("WHILE TRUE DO", "ENDWHILE"),
        ("IF di1=1 THEN", "ENDIF"),
    ] {
        let (found, told) = of_abb(&format!(
            "VAR num h:=1;\n{open}\nMoveL p1,v100,fine,tool0;\nh:=h+1;\n{end}\nMoveL Offs(p1,0,0,h),v100,fine,tool0;"
        ));
        assert_eq!(found.len(), 2, "{open}");
        assert!(found[1].starts_with("unresolved"), "{found:?}");
        assert!(told.iter().any(|t| t == end), "{told:?}");
    }
    let (found, told) = of_abb("VAR num h:=1;\nMoveL p1,v100,fine,tool0;\nGOTO again;");
    assert!(found.len() == 1 && told.iter().any(|t| t.starts_with("GOTO")));
}

#[test]
fn loops_of_a_kuka_come_to_what_they_count() {
    let list = b"DEFDAT W
DECL E6POS XP1={X 1.0,Y 2.0,Z 3.0,A 10.0,B 0.0,C 180.0,S 2,T 35}
DECL E6POS HOMEP={X 0.0,Y 0.0,Z 9.0,A 0.0,B 0.0,C 180.0}
DECL INT N=2
ENDDAT
";
    let of = |body: &str| {
        let text = format!("DEF W()\n{body}\nEND\nDEF Other()\nEND\n");
        moves(&krl::read(text.as_bytes(), Some(list), 1, None).unwrap()[0])
    };
    let counted = of("DECL INT i,j
DECL REAL h
DECL E6POS XA
h = 0.5
XA = XP1
FOR i = 1 TO N
  XA.Z = XA.Z + 2.0
  $VEL.CP = h/10
  LIN XA C_DIS
  LIN {X 80,Y i*2,Z h+30,A 0,B 0,C 180}
  h = h + 1
ENDFOR
j = 0
LOOP
  j = j + 1
  IF j > 2 THEN
    EXIT
  ENDIF
  PTP HOMEP
ENDLOOP
REPEAT
  j = j - 1
  WAIT SEC j
UNTIL j <= 1
WHILE j < 1 ; never
  LIN XP1
ENDWHILE");
    let written = of("$VEL.CP=0.05
LIN {X 1,Y 2,Z 5,A 10,B 0,C 180} C_DIS
LIN {X 80,Y 2,Z 30.5,A 0,B 0,C 180}
$VEL.CP=0.15
LIN {X 1,Y 2,Z 7,A 10,B 0,C 180} C_DIS
LIN {X 80,Y 4,Z 31.5,A 0,B 0,C 180}
PTP HOMEP
PTP HOMEP
WAIT SEC 2
WAIT SEC 1");
    assert_eq!(counted.0, written.0);
    let told = |all: &[String]| all.iter().filter(|t| !t.contains("DECL")).count();
    assert_eq!(told(&counted.1), told(&written.1), "{:?}", counted.1);
    // what is rounded to a whole number, and a counter that would be
    let (found, told) =
        of("DECL INT n\nn = 2.6\nLIN {X n,Y 0,Z 0,A 0,B 0,C 0}\nFOR i=1 TO 2.6\nPTP HOMEP\nENDFOR");
    assert_eq!(found.len(), 1, "{found:?}");
    for line in ["LIN", "FOR"] {
        assert!(told.iter().any(|t| t.starts_with(line)), "{told:?}");
    }
    // a whole number over another, a call that may set what the list declares, an input
    let (found, _) = of(
        "DECL INT i\ni = 5\nLIN {X i/2,Y 0,Z 0,A 0,B 0,C 0}\nXP1.Z = 7\nOther()\nLIN XP1\nFOR i=1 TO $ANIN[1]\nLIN XP1\nENDFOR",
    );
    assert!(
        found
            .iter()
            .all(|m| m.starts_with("unresolved") || m.starts_with("call")),
        "{found:?}"
    );
}

#[test]
fn loops_of_a_script_come_to_what_they_count() {
    let of = |body: &str| {
        let text = format!("def other():\n  global z = 1\nend\ndef w():\n{body}\nend\n");
        let all = ur_script::read(text.as_bytes(), None).unwrap();
        moves(&all[0])
    };
    let counted = of("  z = 0.0
  local i = 0
  v1 = 0.0125
  p1 = p[0.1,0,0,3.1,0,0]
  while i < 3:  # layers
    movel(p[0.08, 0.0, z + 0.03, 3.1, 0, 0], a=1.2, v=v1*2)
    if i == 1:
      movel(p1, v=v1)
    elif i != 0:
      sleep(i)
    else:
      movel(pose_add(p1, p[0,0,z+0.001,0,0,0]), v=v1)
    end
    p1[2] = p1[2] + 0.0022
    z = z + 0.0022
    i = i + 1
  end
  while True:
    movel(p1, v=0.1)
    break
  end");
    let written = of("  movel(p[0.08,0,0.03,3.1,0,0], a=1.2, v=0.025)
  movel(p[0.1,0,0.001,3.1,0,0], v=0.0125)
  movel(p[0.08,0,0.0322,3.1,0,0], a=1.2, v=0.025)
  movel(p[0.1,0,0.0022,3.1,0,0], v=0.0125)
  movel(p[0.08,0,0.0344,3.1,0,0], a=1.2, v=0.025)
  sleep(2)
  movel(p[0.1,0,0.0066,3.1,0,0], v=0.1)");
    assert_eq!(counted, written);
    let (found, told) = of(
        "  global z = 0.5\n  h = 0.1\n  other()\n  movel(p[0,0,z,0,0,0], v=0.1)\n  movel(p[0,0,h,0,0,0], v=0.1)\n  while get_digital_in(1):\n    movel(p[0,0,h,0,0,0], v=0.1)\n    h = h + 1\n  end\n  movel(p[0,0,h,0,0,0], v=0.1)",
    );
    assert!(
        found[1].starts_with("unresolved") && found[2].contains("100.000000"),
        "{found:?}"
    );
    assert!(
        found[3].starts_with("unresolved") && found[4].starts_with("unresolved"),
        "{found:?}"
    );
    assert!(told.iter().any(|t| t.starts_with("while")), "{told:?}");
}

/// What a function within a function sets it sets whenever it runs; what leaves no loop loses no line; a counter ends with its loop.
#[test]
fn nothing_is_taken_for_known_that_is_not() {
    let text = "def w():\n  h = 0.1\n  def up():\n    h = h + 0.1\n  end\n  k = 0.2\n  up()\n  movel(p[0,0,h,0,0,0], v=0.1)\n  movel(p[0,0,k,0,0,0], v=0.1)\nend\n";
    let (found, _) = moves(&ur_script::read(text.as_bytes(), None).unwrap()[0]);
    assert!(
        found.iter().any(|m| m.contains(" 200.000000 ")),
        "{found:?}"
    );
    assert!(
        found.iter().any(|m| m.starts_with("unresolved")),
        "{found:?}"
    );
    let text = "def w():\n  h = 0.1\n  movel(p[0,0,h,0,0,0], v=0.1)\n  break\n  movel(p[0,0,0.3,0,0,0], v=0.1)\nend\n";
    let (found, _) = moves(&ur_script::read(text.as_bytes(), None).unwrap()[0]);
    assert_eq!(found.len(), 2);
    let (found, _) = of_abb(
        "FOR k FROM 1 TO 2 DO\nMoveL Offs(p1,0,0,k),v100,fine,tool0;\nENDFOR\nMoveL Offs(p1,0,0,k),v100,fine,tool0;",
    );
    assert!(
        found.len() == 3 && found[2].starts_with("unresolved"),
        "{found:?}"
    );
}

/// A time goes before speed and acceleration; displaced targets may be displaced again.
#[test]
fn times_of_moves_and_targets_displaced_twice_are_read() {
    let text = "def w():\n  movel(p[0.1,0,0,3.1,0,0], a=1.2, v=0.1, t=4)\n  movel(p[0.2,0,0,3.1,0,0], 1.2, 0.1, 5, 0.001)\n  movec(p[0.2,0.1,0,3.1,0,0], p[0.3,0,0,3.1,0,0], 1.2, 0.1, 0.002)\nend\n";
    let all = ur_script::read(text.as_bytes(), None).unwrap();
    let (found, told) = moves(&all[0]);
    assert!(found[0].contains("value: 4.0, unit: Second"), "{found:?}");
    assert!(
        found[1].contains("value: 5.0, unit: Second") && found[1].contains("Blend(1.0)"),
        "{found:?}"
    );
    assert!(
        found[2].contains("value: 100.0") && found[2].contains("Blend(2.0)"),
        "{found:?}"
    );
    assert_eq!(told, [""; 0]);
    let twice = of_abb("MoveL RelTool(Offs(p1,10,0,5),0,0,-dz),v100,fine,tool0;");
    assert_eq!(twice, of_abb("MoveL Offs(p1,10,0,7.2),v100,fine,tool0;"));
    // however deep
    let deep = format!(
        "MoveL {}p1{},v100,fine,tool0;",
        "Offs(".repeat(2000),
        ",0,0,1)".repeat(2000)
    );
    assert!(of_abb(&deep).0[0].starts_with("unresolved"));
}
