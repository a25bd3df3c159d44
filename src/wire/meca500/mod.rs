//! The Meca500's images, commands, codes and text.
