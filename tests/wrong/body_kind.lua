-- expect: 9: rd.torus: unknown function; did you mean "torque"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "psi",
      bodies = {
        rd.position { 1 },
        rd.torus { mass = 1 },
      } },
  },
}
