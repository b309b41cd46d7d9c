-- expect: 3: setmetatable: __add is of type number, a function is needed
local rd = require "refdyn"
setmetatable({}, { __add = 1 })
