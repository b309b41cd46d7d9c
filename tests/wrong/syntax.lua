-- expect: 9: '}' expected (to close '{' at line 3) near <eof>
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" , mass = 1 },
  },
}
