-- expect: 7: mass: given twice in one table, the first time in line 6
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1,
      mass = 2 },
  },
}
