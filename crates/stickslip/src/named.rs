//! Enumerations whose values have a number and a name each, as tables and documents say them.

/// Declare one: `Value = "name"`, numbered from 0 on.
macro_rules! named {
    ($(#[$of:meta])* pub enum $type:ident { $($(#[$about:meta])* $value:ident = $name:literal),+ $(,)? }) => {
        $(#[$of])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum $type { $($(#[$about])* $value),+ }

        impl $type {
            /// Every value, by its number.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$value),+];

            /// Its name.
            pub fn name(self) -> &'static str {
                match self { $(Self::$value => $name),+ }
            }
        }
    };
}

pub(crate) use named;
