-- expect: 9: s.inputs.pusch: unknown input; did you mean "push"?
local rd = require "refdyn"
rd.input("push", 0, "N")
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
  forces = function(s) return { a_x = s.inputs.pusch } end,
}
