-- expect: 7: coordinate arm_psi_d: differs from coordinate arm_psi by _d, which marks rates; choose another name
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "psi", mass = 1, center = { 0.5, 0, 0 } },
    { "fore", on = "arm", joint = "psi", coordinate = "arm_psi_d", mass = 1, center = { 0.5, 0, 0 } },
  },
}
