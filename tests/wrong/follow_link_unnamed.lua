-- expect: 6: links[1].nam: unknown field; did you mean "name"?
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { nam = "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "arm" },
  hold = { "arm_z" },
}
