-- expect: 6: option "": no identifier of C, a letter and then letters, digits and _ are needed
-- expect: 7: parameter "": no identifier of C, a letter and then letters, digits and _ are needed
-- expect: 8: input "": no identifier of C, a letter and then letters, digits and _ are needed
-- expect: 15: point "": no identifier of C, a letter and then letters, digits and _ are needed
local rd = require "refdyn"
rd.option("", 1)
rd.parameter("", 1)
rd.input("")
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
    { "hand", on = "arm", joint = "psi", mass = 1, inertia = { zz = 1 } },
  },
  points = { [""] = "arm" },
}
