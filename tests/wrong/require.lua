-- expect: 2: require: socket.lua in the folder of the model cannot be read: No such file or directory
local socket = require "socket"
