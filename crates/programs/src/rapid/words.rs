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
    }
}
