// The version of ldi: semantic versioning, one number for the whole library.
#pragma once

#define LDI_VERSION_MAJOR 0
#define LDI_VERSION_MINOR 1
#define LDI_VERSION_PATCH 0
