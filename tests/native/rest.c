/* FMI 2.0 asks for every function of the interface: those that a small FMU has no use for answer with an error. */
#include "fmi2.h"

#define WEAK __attribute__((weak, visibility("default")))

/* Functions that do nothing, the weak ones unless an FMU has its own. */
FMI const char *fmi2GetTypesPlatform(void) { return "default"; }
FMI const char *fmi2GetVersion(void) { return "2.0"; }
FMI fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) { return fmi2OK; }
WEAK fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean t, fmi2Real tolerance, fmi2Real start, fmi2Boolean s, fmi2Real stop) { return fmi2OK; }
WEAK fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
WEAK fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
FMI fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }

#define REST(name) WEAK fmi2Status name(fmi2Component c) { return fmi2Error; }

WEAK fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean keep) { return fmi2Error; }
REST(fmi2GetInteger) REST(fmi2GetBoolean) REST(fmi2GetString) REST(fmi2SetInteger) REST(fmi2SetBoolean) REST(fmi2SetString)
REST(fmi2GetFMUstate) REST(fmi2SetFMUstate) REST(fmi2FreeFMUstate)
REST(fmi2SerializedFMUstateSize) REST(fmi2SerializeFMUstate) REST(fmi2DeSerializeFMUstate)
REST(fmi2GetDirectionalDerivative) REST(fmi2SetRealInputDerivatives) REST(fmi2GetRealOutputDerivatives)
REST(fmi2GetStatus) REST(fmi2GetRealStatus) REST(fmi2GetIntegerStatus) REST(fmi2GetBooleanStatus) REST(fmi2GetStringStatus)
