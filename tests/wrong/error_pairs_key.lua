-- expect: 3: pairs: a key of type boolean; keys must be numbers or names
local rd = require "refdyn"
for name in pairs({ [true] = 1 }) do end
