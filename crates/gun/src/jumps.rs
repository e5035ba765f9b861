//! What becomes of jumps: the deflection is ordered to their ends at once, and the beam waits there.

use crate::stretch::Stretch;

/// The stretches with each jump ordered to its end at once. There the beam waits as long as the job's own jump takes, and as long as `jump`
/// says, s, where that is longer: by how much all of them take longer comes back, too. A dark way no faster than the line after it leads
/// into that line and is drawn as it is asked for.
pub(crate) fn ordered(asked: &[Stretch], jump: Option<f64>) -> (Vec<Stretch>, f64) {
    let mut all = Vec::with_capacity(asked.len());
    let mut later = 0.0;
    let mut rest = asked;
    while let Some(first) = rest.first() {
        let later_by = |s: &Stretch, later: f64| Stretch {
            time: s.time + later,
            ..*s
        };
        if first.is_lit() {
            all.push(later_by(first, later));
            rest = &rest[1..];
            continue;
        }
        let dark = rest.iter().take_while(|s| !s.is_lit()).count();
        let (jumps, next) = (&rest[..dark], rest.get(dark));
        let ahead = jumps.iter().map(|s| s.from.distance(s.to)).sum::<f64>() > 0.0;
        let leading = next.map_or(0, |line| lead(jumps, line));
        let (jumps, leads) = jumps.split_at(dark - leading);
        let to = jumps.last().map_or(first.from, |s| s.to);
        let mut gone = false;
        for stretch in jumps {
            let stretch = later_by(stretch, later);
            // where the beam rests before it jumps, it rests
            if !gone && stretch.from.distance(stretch.to) > 0.0 {
                gone = true;
                all.push(Stretch {
                    takes: 0.0,
                    to,
                    ..stretch
                });
            }
            if gone {
                all.push(Stretch {
                    from: to,
                    to,
                    ..stretch
                });
            } else {
                all.push(stretch);
            }
        }
        let taken: f64 = rest[..dark].iter().map(|s| s.takes).sum();
        let lacks = jump.map_or(0.0, |jump| jump - taken);
        // the beam comes on again after that; what follows the last line waits for nothing
        if let (true, true, Some(line)) = (ahead, lacks > 0.0, next) {
            let begins = leads.first().map_or(line.time, |s| s.time);
            all.push(Stretch {
                time: begins + later,
                takes: lacks,
                from: to,
                to,
                power: 0.0,
                spot: line.spot,
            });
            later += lacks;
        }
        all.extend(leads.iter().map(|s| later_by(s, later)));
        rest = &rest[dark..];
    }
    all.retain(|s| s.takes > 0.0 || s.from != s.to);
    (all, later)
}

/// How many of the last dark stretches lead into a line: they are no faster than it.
fn lead(dark: &[Stretch], line: &Stretch) -> usize {
    let speed = line.velocity().length() * (1.0 + 1e-6);
    let leads = |s: &&Stretch| s.takes > 0.0 && s.from != s.to && s.velocity().length() <= speed;
    dark.iter().rev().take_while(leads).count()
}
