-- expect: 3: pairs: a key of type boolean, numbers and names have an order
local rd = require "refdyn"
for name in pairs({ [true] = 1 }) do end
