//! What programs call on an ABB controller: the `[program.rapid]` table of a cell file.

use meltpath_base::table;

table! {
    /// Names of data that the controller holds.
    pub struct RapidWords {
        /// Who says so: the backup of the controller.
        source: String => required;
        /// The torch: a `tooldata`, its centre point at the wire tip at the nominal contact-tube distance.
        tool: String => required;
        /// The part: a `wobjdata`.
        work_object: String => required;
        /// How the arc starts and ends: a `seamdata`.
        seam: String => required;
        /// How the arm weaves (`weave_type`): 0 by all axes, 1 by the wrist.
        weave_type: u32 where within(0.0, 1.0) => default(0, "by all axes");
    }
}
