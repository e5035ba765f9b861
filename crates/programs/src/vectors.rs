//! Vector lists: the moves of a scan head as comma-separated values, one straight move a line, read and written layer by layer.
//!
//! The form is this project's: a heading line, then one line for each vector with where it ends. `kind`, `x_mm` and `y_mm` are
//! needed; `z_mm`, `speed_mm_s`, `power_W`, `wait_s`, `part`, `layer` and `height_mm` are not, and may be blank in any
//! line. The first vector of each layer is a `start`. Commas, semicolons or tabs separate; `#` begins a comment.

mod read;
mod words;
mod write;

pub use read::{Reader, UnlitPower, VectorListError, line_of};
pub use write::{VectorWriteError, Writer};

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use meltpath_geometry::math::DVec3;
    use meltpath_toolpath::{Channel, Layer, Move, PassHead, Role};

    use super::words::KINDS;
    use super::{Reader, VectorListError, VectorWriteError, Writer, line_of};

    fn read(text: &str) -> Result<Vec<Layer>, VectorListError> {
        Reader::new(text.as_bytes())?.collect()
    }

    fn written(layers: &[Layer]) -> String {
        let mut text = Vec::new();
        let mut writer = Writer::new(&mut text).unwrap();
        for layer in layers {
            writer.layer(layer).unwrap();
        }
        writer.finish().unwrap();
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        for (text, line, words) in [
            ("", 1, "empty"),
            ("kind,x [mm]\n", 1, "y_mm"),
            ("kind,x [mm],y [mm],x [mm]\n", 1, "twice"),
            ("kind,x,y\n", 1, "no column \"x\""),
            ("kind,x [mm],y [mm]\n", 1, "no vector"),
            ("kind,x [mm],y [mm]\nfill,0,0\n", 2, "begin with a `start`"),
            ("kind,x [mm],y [mm]\nstart,0,0\nfil,0,0\n", 3, "contour"),
            ("kind,x [mm],y [mm]\nstart,0,\n", 2, "blank"),
            ("kind,x [mm],y [mm]\nstart,0,nan\n", 2, "finite"),
            ("kind,x [mm],y [mm]\nstart,0,0,9\n", 2, "4 fields"),
            (
                "kind,x [mm],y [mm]\nstart,0,0\nstart,1,1\n",
                3,
                "second `start`",
            ),
            (
                "kind;x [mm];y [mm];speed [mm/s]\n# a comment\nstart;0;0;0\n",
                3,
                "above zero",
            ),
            (
                "kind,x [mm],y [mm],wait [s]\nstart,0,0,-1\n",
                2,
                "not be negative",
            ),
            (
                "kind,x [mm],y [mm],wait [s]\nstart,0,0,0\nfill,1,0,1e9\n",
                3,
                "at most 3600",
            ),
            (
                "kind,x [mm],y [mm],speed [mm/s]\nstart,0,0,\njump,1,0,1e7\n",
                3,
                "at most 1000000",
            ),
            (
                "kind,x [mm],y [mm],power [W]\nstart,0,0,0\njump,1,0,0\nfill,2,0,0\n",
                4,
                "above zero",
            ),
            (
                "kind,x [mm],y [mm],power [W]\nstart,0,0,0\nfill,2,0,1e9\n",
                3,
                "at most 1000000",
            ),
            (
                "kind,x [mm],y [mm],layer\nstart,0,0,1\nstart,0,0,2\nstart,0,0,1\n",
                4,
                "comes again",
            ),
        ] {
            let error = read(text).unwrap_err();
            assert_eq!(error.line, line, "{error}");
            assert!(error.what.contains(words), "{error}");
        }
    }

    #[test]
    fn passes_of_planning_are_written_with_jumps_between_them() {
        let mut layer = Layer::new(4, 0.12);
        let mut head = PassHead {
            part: 2,
            role: Role::Contour,
            ..PassHead::default()
        };
        let mut contour = layer.begin(head, DVec3::ZERO);
        contour.go(
            Move::Arc {
                via: DVec3::new(1.0, 1.0, 0.0),
            },
            DVec3::X * 2.0,
        );
        contour.set(Channel::Speed, 700.0);
        head.role = Role::Fill;
        layer.polyline(head, [DVec3::X * 3.0, DVec3::X * 4.0]);
        let read = read(&written(std::slice::from_ref(&layer))).unwrap();
        read[0].sanity_check().unwrap();
        assert_eq!((read[0].number, read[0].height), (4, 0.12));
        let roles: Vec<_> = read[0].passes().map(|p| p.head.role).collect();
        assert_eq!(roles, [Role::Jump, Role::Contour, Role::Jump, Role::Fill]);
        let arc = read[0].pass(1);
        assert!((arc.length() - std::f64::consts::PI).abs() < 1e-2);
        assert!((0..arc.move_count()).all(|i| arc.value(Channel::Speed, i) == Some(700.0)));
        let mut spots = Layer::new(5, 0.0);
        let mut pass = spots.begin(head, DVec3::ZERO);
        pass.go(Move::Spot { time: 1e-3 }, DVec3::ZERO);
        let mut writer = Writer::new(Vec::new()).unwrap();
        assert!(matches!(
            writer.layer(&spots),
            Err(VectorWriteError::Spot { pass }) if pass.layer == 5
        ));
        writer.layer(&layer).unwrap();
        assert!(matches!(
            writer.layer(&layer),
            Err(VectorWriteError::Again { layer: 4 })
        ));
    }

    #[test]
    fn powers_without_light_are_counted_and_places_found() {
        let text = "kind,x_mm,y_mm,z_mm,power_W,layer\nstart,0,0,,,1\njump,1,0,,0,1\njump,2,0,,200,1\nfill,3,0,4,200,1\n\
                    run,4,0,,5,1\nstart,0,0,,,2\nfill,3,0,4,,2\n";
        let mut reader = Reader::new(text.as_bytes()).unwrap();
        assert_eq!(reader.by_ref().count(), 2);
        let unlit = reader.unlit_power();
        assert_eq!((unlit.line, unlit.lines), (4, 2));
        let line = |layer| line_of(text.as_bytes(), layer, DVec3::new(3.0, 0.0, 4.0));
        assert_eq!([1, 2, 3].map(line), [Some(5), Some(8), None]);
    }

    #[test]
    fn lists_are_read_layer_by_layer() {
        let text = "kind,x [mm],y [mm],layer\nstart,0,0,1\nfill,1,0,1\nstart,0,0,2\nfill,1\n";
        let mut reader = Reader::new(text.as_bytes()).unwrap();
        assert_eq!(reader.next().unwrap().unwrap().number, 1);
        assert_eq!(reader.next().unwrap().unwrap_err().line, 5);
        assert!(reader.next().is_none());
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_back(
            numbers in prop::collection::vec((-200.0..200.0f64, -200.0..200.0f64, 1usize..6, prop::option::of(1.0..3e3f64), 0u32..3), 1..40)
        ) {
            let mut layers = Vec::new();
            for (k, chunk) in numbers.chunks(7).enumerate() {
                let mut layer = Layer::new(k as u32 + 1, 0.03 * k as f64);
                let mut at = DVec3::new(chunk[0].0, chunk[0].1, 0.0);
                for (i, &(x, y, kind, speed, part)) in chunk.iter().enumerate() {
                    let role = if i == 0 { Role::Jump } else { KINDS[kind - 1].0 };
                    let head = PassHead { part, role, ..PassHead::default() };
                    let mut pass = layer.begin(head, at);
                    at = DVec3::new(x, y, 0.0);
                    pass.line_to(at);
                    for channel in [Channel::Speed, Channel::Power, Channel::Dwell] {
                        speed.map(|v| pass.set(channel, v));
                    }
                }
                layers.push(layer);
            }
            let again = read(&written(&layers)).unwrap();
            let vectors = |layers: &[Layer]| -> Vec<_> {
                layers.iter().flat_map(Layer::passes).flat_map(|p| (0..p.move_count()).map(move |i| {
                    let values = Channel::ALL.map(|c| p.value(c, i));
                    (p.layer, p.head.role, p.head.part, p.points[i], p.points[i + 1], values)
                }).collect::<Vec<_>>()).collect()
            };
            prop_assert_eq!(vectors(&again), vectors(&layers));
            for (a, b) in again.iter().zip(&layers) {
                a.sanity_check().unwrap();
                prop_assert_eq!(a.height, b.height);
            }
            prop_assert_eq!(read(&written(&again)).unwrap(), again);
        }

        #[test]
        fn nothing_panics(text in "(kind,x \\[mm\\],y \\[mm\\]\n)?[a-z0-9,.;#\n -]{0,200}") {
            let _ = read(&text);
        }
    }
}
