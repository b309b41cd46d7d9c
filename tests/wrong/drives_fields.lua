-- expect: 8: drives[1]: a number; must be a coordinate, or { "arm_psi", limit = 100 }
-- expect: 9: drives[2].limit: value -1; must be positive
-- expect: 10: drives[3].to: has no effect without from; add from
local rd = require "refdyn"
return rd.model {
  name = "wrong", links = { { "a", joint = "x", mass = 1 } },
  drives = {
    7,
    { "a_x", limit = -1 },
    { "push", to = "a" },
  },
}
