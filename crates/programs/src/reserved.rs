//! Names that programs must not have: words of their own language, and files that some disks cannot hold.

use crate::program::Dialect;

/// Names of devices: no disk of a Windows computer holds a file called so, whatever its ending.
const DEVICES: [&str; 4] = ["CON", "PRN", "AUX", "NUL"];

/// Words of RAPID (ABB, Technical reference manual RAPID Overview, reserved words), and the entry of every task. Case does not count.
const RAPID: &str = "ALIAS AND BACKWARD CASE CONNECT CONST DEFAULT DIV DO ELSE ELSEIF ENDFOR ENDFUNC ENDIF ENDMODULE ENDPROC ENDRECORD \
    ENDTEST ENDTRAP ENDWHILE ERROR EXIT FALSE FOR FROM FUNC GOTO IF INOUT LOCAL MAIN MOD MODULE NOSTEPIN NOT NOVIEW OR PERS PROC RAISE \
    READONLY RECORD RETRY RETURN STEP STOP SYSMODULE TEST THEN TO TRAP TRUE TRYNEXT UNDO VAR VIEWONLY WHILE WITH XOR";

/// Words of KRL, its types among them. Case does not count.
const KRL: &str = "AND ANIN ANOUT AXIS BOOL BRAKE BY CASE CAST_FROM CAST_TO CHAR CIRC CIRC_REL CONFIRM CONST CONTINUE DECL DEF DEFAULT \
    DEFDAT DEFFCT DELAY DISTANCE DO E6AXIS E6POS ELSE END ENDDAT ENDFCT ENDFOR ENDIF ENDLOOP ENDSPLINE ENDSWITCH ENDWHILE ENUM EXIT EXT \
    EXTFCT EXTP FALSE FOR FRAME GLOBAL GOTO HALT IF IMPORT INT INTERRUPT IS LIN LIN_REL LOOP MAXIMUM MINIMUM NOT OR PATH POS PRIO PTP \
    PTP_REL PUBLIC PULSE REAL REPEAT RESUME RETURN SCIRC SEC SIGNAL SLIN SPL SPLINE SPTP SREAD STRUC SWITCH SWRITE THEN TO TRIGGER TRUE \
    UNTIL WAIT WHEN WHILE WITH XOR";

/// Whether a program of `dialect` cannot be called `name`, which is in capitals.
pub(crate) fn is_reserved(dialect: Dialect, name: &str) -> bool {
    let port = name
        .strip_prefix("COM")
        .or_else(|| name.strip_prefix("LPT"));
    let port = port.is_some_and(|n| matches!(n.as_bytes(), [b'0'..=b'9']));
    let word = match dialect {
        Dialect::Rapid => RAPID.split_whitespace().any(|w| w == name),
        Dialect::Krl => KRL.split_whitespace().any(|w| w == name),
        // a project has a `start` and a `stop`: a disk that takes capitals for small letters holds one file for both
        Dialect::Val3 => matches!(name, "START" | "STOP"),
        // their words are no names, or differ from them in case
        Dialect::FanucLs | Dialect::Inform | Dialect::UrScript => false,
    };
    port || word || DEVICES.contains(&name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_the_language_and_devices_are_no_names() {
        for (dialect, name, reserved) in [
            (Dialect::Rapid, "TEST", true),
            (Dialect::Rapid, "TESTS", false),
            (Dialect::Krl, "FRAME", true),
            (Dialect::Krl, "TEST", false),
            (Dialect::Val3, "STOP", true),
            (Dialect::FanucLs, "STOP", false),
            (Dialect::FanucLs, "AUX", true),
            (Dialect::Inform, "COM1", true),
            (Dialect::Inform, "COM10", false),
            (Dialect::Inform, "COMPASS", false),
        ] {
            assert_eq!(is_reserved(dialect, name), reserved, "{name}");
        }
    }
}
