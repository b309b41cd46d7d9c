-- expect: 9: '}' expected (to close '{' at line 3) near <eof>; the '{' in line 6 may lack its end
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" , mass = 1 },
  },
}
