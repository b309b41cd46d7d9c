-- expect: 11: '}' expected (to close '{' at line 3) near <eof>; the '{' in line 7 may lack its end
local rd = require "refdyn"
return rd.model {
  name = "wrong",
  links = {
    { "a", joint = "x", mass = 1 },
    { "b", joint = { "x" }, spring = { x = 1, mass = 1 },
  },
  points = { E = "a" },
}
